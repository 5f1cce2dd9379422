"""Elementwise operations on arrays in place: NumPy's where they are interpreted, loops where they are compiled.

Both give the same numbers, since every element is one rounded product or sum. NumPy's functions compile as well, but for arrays
of a few dozen elements their tests of shapes take longer than the arithmetic.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def multiply(x: Array, y: Any, out: Array) -> None:
    """Write the products x·y.

    `x`: shape (l,) or (k, l) or (k, 1). `y`: a number or an array of shape (l,). `out`: array for the products, shape (l,) or
    (k, l).
    """
    np.multiply(x, y, out)


def add(x: Array, y: Array, out: Array) -> None:
    """Write the sums x + y of arrays of equal shape, (l,) or (k, l)."""
    np.add(x, y, out)


def add_outer(x: Array, y: Array, out: Array, scratch: Array) -> None:
    """Add the products x·yᵀ.

    `x`: shape (k, 1). `y`: shape (l,). `out`: array to add to, shape (k, l). `scratch`: an array to work in, shape (k, l).
    """
    np.multiply(x, y, scratch)
    np.add(out, scratch, out)
