"""A law as a program: one recording of what it computes, and the languages that this is written in.

What compiles or prints laws is built on it: rooms from `vehicle` up may import it.

`recorded.py` has the numbers that a law is called with, and `operations.py` every operation with its form in each language.
"""
