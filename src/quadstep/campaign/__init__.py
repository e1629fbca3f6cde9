"""Very many flights that differ as a file says: drawn, flown, stored, and summed up with intervals."""
