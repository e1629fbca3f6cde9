"""`quadstep prove`: proofs about a flight, by enclosures of the laws that fly. See docs/prove.md."""
