"""quadstep: how well, and how surely, will this controller hold my vehicle on its path?"""

__version__ = "0.1.0"
