"""Control laws as C99: traced once and written as functions with the same results, to the bit, as every other engine."""
