"""Logs of real flights: reading them, and judging what they really hold."""
