"""Tests. Hypothesis draws the same examples on every run and times none of them."""

from hypothesis import settings

settings.register_profile("steady", deadline=None, derandomize=True, database=None)
settings.load_profile("steady")
