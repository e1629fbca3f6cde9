"""`quadstep what-if`: what a change of an autopilot's parameters does to a vehicle, before and after.

A step in calm air, the margins at rest, and the same flights in gusts with both sets of parameters: flight i has the same wind
and the same noise of the gyro with either, so that differences are paired.
"""
