"""`quadstep study vehicles`: every preset vehicle through the same flights under every controller, over many seeds."""
