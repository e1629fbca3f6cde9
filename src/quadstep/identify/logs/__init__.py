"""Logs of real flights: reading them, and checking what they really contain."""
