"""Our vehicle under somebody else's autopilot: software in the loop, and setpoints for a vehicle in its own simulator."""
