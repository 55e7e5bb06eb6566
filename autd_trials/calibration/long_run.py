"""How much a sum scatters whose terms may be correlated in time: the long-run covariance."""

import numpy as np
from numpy.typing import NDArray

_SMALLEST_VALUE = 1e-12
_TINY = 1e-300
_LEAST_LEFT = 0.02  # 1 less the sum of an autoregression's coefficients: at most 2500 terms tell as much as one


def long_run_covariance(terms: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Return the covariance of the sum of terms that follow each other in time, and how many count.

    The terms have mean 0; the covariance has shape (p, p). As many independent terms would scatter as much.

    The sum of the terms' outer products is right for independent terms only. So each component is described by
    an autoregression (Berk, 1974, Annals of Statistics 2, 489), whose order follows from Akaike's criterion: slow
    noise below much white noise is seen by it too, where the correlation from one term to the next is small. What
    is left is independent in time, and is scaled up by what the autoregressions make of it at frequency 0. The
    result is never smaller than for independent terms.

    Parameters
    ----------
    terms
        In the order of time, shape (n, p); zeros where there is none.
    """
    alone: NDArray[np.float64] = terms.T @ terms
    sizes = np.sqrt(np.diag(alone)) + _TINY
    values, axes = np.linalg.eigh(alone / np.outer(sizes, sizes))
    kept = values > _SMALLEST_VALUE * values.max()
    roots = np.sqrt(values[kept])
    whitened = terms / sizes @ (axes[:, kept] / roots)
    summed = np.column_stack([_independent(component) for component in whitened.T])
    inflation, turned = np.linalg.eigh(summed.T @ summed)
    inflation = inflation.clip(1)
    back = sizes[:, None] * (axes[:, kept] * roots) @ turned
    covariance: NDArray[np.float64] = back * inflation @ back.T
    return covariance, float(terms.any(axis=1).sum() / inflation.mean())


def _independent(component: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return independent terms whose sum scatters as that of a component, shape (n,)."""
    coefficients = _autoregression(component)
    left = np.convolve(component, np.append(1.0, -coefficients))[: len(component)]
    return left / max(1 - float(coefficients.sum()), _LEAST_LEFT)


def _autoregression(component: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the coefficients of an autoregression by Levinson and Durbin, of Akaike's order."""
    count = len(component)
    spectrum = np.abs(np.fft.rfft(component, 2 * count)) ** 2
    covariances = np.fft.irfft(spectrum)[:count]
    best, coefficients = np.empty(0), np.empty(0)
    variance = covariances[0]
    least = criterion = 0.0
    for order in range(1, min(int(10 * np.log10(max(count, 1))), count // 4) + 1):
        reflection = (covariances[order] - coefficients @ covariances[order - 1 : 0 : -1]) / (variance + _TINY)
        coefficients = np.append(coefficients - reflection * coefficients[::-1], reflection)
        variance *= 1 - reflection**2
        criterion += count * float(np.log(max(1 - reflection**2, _TINY))) + 2
        if criterion < least:
            least, best = criterion, coefficients
    return best
