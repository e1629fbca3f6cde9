"""`quadstep prove`: bounds on every flight's distance from its path, proved by interval enclosures. See docs/prove.md."""
