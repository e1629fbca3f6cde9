"""The closed loop, the engines that fly it, and the log.

Rooms from `mission` up may import it.
"""
