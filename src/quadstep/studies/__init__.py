"""Questions asked of flights: of one (`flights/`), of many (`campaign/`, `rare/`, `envelope/`), of several laws, the paper's.

Only proofs and commands may import it.
"""
