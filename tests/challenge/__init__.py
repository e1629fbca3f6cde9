"""`make challenge`: a search, for every verdict, for what contradicts it, by methods that the verdict does not use.

Each module here but `search` and `__main__` has `SEARCHES`; adding a module adds its searches.
"""
