"""Other people's simulators: their vehicles under our controllers, their controllers and autopilots on our vehicles.

Studies and proofs get to them through doors; only commands may import it.
"""
