"""Every equation of the paper against the code: SymPy symbols go through the functions that fly, a row each."""
