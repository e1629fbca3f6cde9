"""Mission files: what a user may write, checked, and turned into a flight."""
