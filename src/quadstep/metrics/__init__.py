"""What is measured of a flight: each metric declared once, computed from a log or summed while flying.

Rooms from `engines` up may import it.
"""
