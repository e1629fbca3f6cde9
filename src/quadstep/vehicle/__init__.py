"""What flies: the paper's equations, a real vehicle's, and the plants made of them.

Laws over numbers; rooms from `control` up may import it.
"""
