"""How things are written to a terminal, a file or a pipe: the one place that decides widths, characters and broken streams."""
