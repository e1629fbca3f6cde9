"""Mission files: their schema, their checks, and the flights they describe."""
