"""What users bring along: controllers, paths, winds, metrics and plants in Python files that a mission names."""
