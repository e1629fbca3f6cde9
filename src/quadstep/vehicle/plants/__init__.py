"""What can be flown: each plant is one file, a `Plant` over numbers."""
