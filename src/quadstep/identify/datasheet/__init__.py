"""From what people know of a vehicle, its data sheet and a thrust stand, to one that flies."""
