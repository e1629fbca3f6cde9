"""`quadstep compare`: controllers judged under the same conditions, on the same draws, with the same budget of tuning."""
