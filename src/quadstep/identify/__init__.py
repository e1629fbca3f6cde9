"""From logs of real flights to a vehicle for the simulator, and how well it predicts the flights.

Studies, proofs and commands may import it.
"""
