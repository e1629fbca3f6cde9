"""Output to a terminal, a file or a pipe: the one place that handles widths, characters and broken streams."""
