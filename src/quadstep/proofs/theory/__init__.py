"""The repaired theorem (docs/theory.md): inequalities checked on random states, and how much the completed law gains."""
