"""`quadstep export`: the law that was judged, as C for the vehicle.

Studies, proofs and commands may import it.
"""
