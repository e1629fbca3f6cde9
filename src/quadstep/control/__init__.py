"""Controllers: the paper's adaptive neural backstepping (Eqs 11-54) and the nested saturations of its reference [11]."""
