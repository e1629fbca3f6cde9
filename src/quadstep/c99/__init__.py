"""Control laws as C99: traced once, written as functions that give the bits of every other engine."""
