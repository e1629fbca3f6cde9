"""`quadstep envelope`: where in the plane of two of its keys a mission can be flown, and how well."""
