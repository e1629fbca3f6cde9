"""Exit codes of the command line.

A flight that diverged ends with DIVERGED even where it was required to do something as well: each code means the same with and
without `--require`, and what was measured of a flight that ended early covers only a part of it. OUTPUT_LOST, what
a command had to say did not arrive, comes before all others.
"""

FAILED, BAD_INPUT, DIVERGED, UNMET, OUTPUT_LOST, INTERRUPTED = 1, 2, 3, 4, 5, 130
