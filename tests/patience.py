"""How long tests wait for what must happen."""

PATIENCE = 300.0
"""Seconds until something counts as hanging: a hundred times what most takes, so that a busy machine makes no test fail."""
