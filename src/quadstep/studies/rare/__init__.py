"""Probabilities of failure far below what flights drawn one by one can show: `quadstep campaign --rare`."""
