"""The page that flies: missions as one HTML file in which the same laws fly as JavaScript.

Studies, proofs and commands may import it.
"""
