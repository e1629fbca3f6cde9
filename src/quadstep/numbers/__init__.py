"""Kinds of numbers.

Laws and all that runs them are built on it: every room but `io` may import it.

Every law of the package is a pure function over numbers, and a number is anything that adds, multiplies and has a sine:
a Python float, a NumPy array (a batch by broadcasting) or a lane (an instruction of a compiled program).
This folder holds the functions, vectors and named structures that work for all of them.

>>> from quadstep.numbers import clip, sqrt, vector
>>> def pull(offset, most):
...     return clip(2.0 * offset.norm(), 0.0, most)
>>> pull(vector(3.0, 4.0), 8.0)
8.0
>>> import numpy as np
>>> pull(vector(np.array([3.0, 0.3]), np.array([4.0, 0.4])), 8.0)
array([8., 1.])
"""

from quadstep.numbers import elementary
from quadstep.numbers.elementary import *  # noqa: F403 (whatever it declares)
from quadstep.numbers.functions import absolute, clip, largest, maximum, minimum, power, smallest, sqrt, where
from quadstep.numbers.kinds import Condition, Number
from quadstep.numbers.scan import scan, shortcut
from quadstep.numbers.structure import Structure, Table, flatten, in_matrix, leaf_names, rebuild
from quadstep.numbers.vectors import Matrix, Vector, either, matrix, outer, solve_symmetric, total, vector

__all__ = [
    "Condition", "Matrix", "Number", "Structure", "Table", "Vector", "absolute", "clip", "either", "flatten", "in_matrix",
    "largest", "leaf_names", "matrix", "maximum", "minimum", "outer", "power", "rebuild", "scan", "shortcut", "smallest",
    "solve_symmetric", "sqrt", "total", "vector", "where",
]  # fmt: skip
__all__ += elementary.__all__
