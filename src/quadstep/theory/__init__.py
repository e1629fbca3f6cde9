"""The repaired theorem (docs/theory.md), its inequalities checked on random states, and what the completed controller buys."""
