"""Fuzzing: whatever a file holds, it is read and flown, or refused with one clean line.

`python -m tests.fuzz` (or `make fuzz`) tries 100,000 files and says how to try one again; `make test` tries 5,000 of them.

`mutate.py`: how a good file becomes a bad one. `kinds.py`: the kinds of file, and what is done with each. `judge.py`: the
verdict on one case. `run.py`: many cases on many processes.
"""
