"""A vehicle of your own whose numbers are computed: a lighter X500 (docs/extending.md)."""

RACER = {"preset": "x500", "mass": 1.5}
