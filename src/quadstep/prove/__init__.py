"""`quadstep prove`: what is certain of a flight, by enclosures of the laws that fly. See docs/prove.md."""
