"""Questions asked of flights: of one (`fly.py`), of many (`campaign/`, `rare/`, `envelope.py`), of several laws, the paper's.

Only proofs and commands may import it.
"""
