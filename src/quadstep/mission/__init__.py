"""Mission files: their schema, their checks, and the flights they describe.

All uses of a plan, studies, proofs and commands may import it.
"""
