"""Many flights that vary as a file says: drawn, flown, stored, and summarised with intervals."""
