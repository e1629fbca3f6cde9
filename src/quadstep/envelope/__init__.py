"""`quadstep envelope`: where over two keys of a mission it can be flown, and how well."""
