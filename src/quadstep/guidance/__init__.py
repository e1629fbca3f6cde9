"""Where the vehicle should be: paths over time, from the paper's minimum jerk (Eqs 68-75) to recorded flights."""
