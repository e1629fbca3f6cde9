"""What a flight shows: metrics of a log."""
