"""What is around the vehicle: the air that it flies in and the paths that it should follow.

Laws over numbers; rooms from `control` up may import it.
"""
