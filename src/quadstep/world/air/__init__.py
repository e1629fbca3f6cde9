"""The air: wind that is constant, swings, gusts or is turbulent."""
