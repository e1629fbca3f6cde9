"""From logs of real flights to the vehicle that the simulator flies, and how well it predicts them."""
