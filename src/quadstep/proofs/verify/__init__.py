"""Every equation of the paper checked against the code, one row each: the functions that fly, evaluated with SymPy symbols."""
