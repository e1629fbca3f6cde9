"""Exit codes of the command line.

A flight that diverged ends with DIVERGED even where it was required to do something as well: each code means the same with and
without `--require`, and what was measured of a flight that ended early covers only a part of it.
"""

FAILED, BAD_INPUT, DIVERGED, UNMET, INTERRUPTED = 1, 2, 3, 4, 130
