"""Tests. Hypothesis draws the same examples on every run and times none of them."""

import pytest
from hypothesis import settings

pytest.register_assert_rewrite("tests.missions", "tests.verdicts")

settings.register_profile("steady", deadline=None, derandomize=True, database=None)
settings.load_profile("steady")
