"""`quadstep linear`: the sampled closed loop, linearised as it flies: poles, margins, responses (`docs/linear.md`).

Studies, proofs and commands may import it.
"""
