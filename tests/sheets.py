"""A data sheet as people have them."""

SHEET = """
name = "Five inch"
mass = 0.62
wheelbase = 0.22
kv = 1950
cells = 4
capacity = 1.5
motor_mass = 0.033
propeller = { inches = [5.1, 4.3] }
"""
