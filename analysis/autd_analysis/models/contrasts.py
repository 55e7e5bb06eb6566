"""Contrasts of coefficients, and what they leave free."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def null_space(contrasts: Array) -> Array:
    """Return an orthonormal basis of what contrasts of full rank, shape (k, coefficients), do not see."""
    basis: Array = np.linalg.svd(contrasts)[2][len(contrasts) :].T
    return basis
