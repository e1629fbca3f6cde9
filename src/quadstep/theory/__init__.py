"""The repaired theorem (docs/theory.md): inequalities checked on random states, and what the completed controller gains."""
