"""How much a sum scatters whose terms may be correlated in time: the long-run covariance."""

import numpy as np
from numpy.typing import NDArray

_LARGEST_CORRELATION = 0.97
_SIGNIFICANT = 2.0  # standard deviations
_SMALLEST_VALUE = 1e-12
_TINY = 1e-300


def long_run_covariance(terms: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Return the covariance of the sum of terms that follow each other in time, and how many count.

    The terms have mean 0; the covariance has shape (p, p). As many independent terms would scatter as much.

    The sum of the terms' outer products is right for independent terms only. Andrews (1991, Econometrica 59,
    817) adds the products of terms some way apart, weighted by the quadratic spectral kernel; its bandwidth
    follows from the terms' autocorrelation. The result is never smaller than for independent terms.

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
    inflation, turned = np.linalg.eigh(_smoothed(whitened, _bandwidth(whitened)))
    back = sizes[:, None] * (axes[:, kept] * roots) @ turned
    inflation = inflation.clip(1)
    covariance: NDArray[np.float64] = back * inflation @ back.T
    return covariance, float(terms.any(axis=1).sum() / inflation.mean())


def _bandwidth(whitened: NDArray[np.float64]) -> float:
    """Return Andrews' bandwidth in terms, from a first-order autoregression of each component."""
    pairs = whitened[1:].any(axis=1) & whitened[:-1].any(axis=1)
    now, then = whitened[1:][pairs], whitened[:-1][pairs]
    products, squares = (now * then).sum(axis=0), ((now**2 + then**2) / 2).sum(axis=0)
    rho = (products / (squares + _TINY)).clip(0, _LARGEST_CORRELATION)
    rho[rho < _SIGNIFICANT / np.sqrt(max(len(now), 1))] = 0.0  # not told from independent terms
    alpha = (4 * rho**2 / (1 - rho) ** 8).sum() / (1 / (1 - rho) ** 4).sum()
    return float(1.3221 * (alpha * len(whitened)) ** 0.2)


def _smoothed(whitened: NDArray[np.float64], bandwidth: float) -> NDArray[np.float64]:
    """Return the sum over all lags of the kernel times the autocovariance, by Fourier transforms."""
    count = len(whitened)
    kernel = _quadratic_spectral(np.arange(count) / max(bandwidth, _TINY))
    weights = np.fft.rfft(np.concatenate([kernel, [0.0], kernel[:0:-1]])).real
    weights[1:-1] *= 2  # the other half of the spectrum
    spectrum = np.fft.rfft(whitened, 2 * count, axis=0)
    smoothed: NDArray[np.float64] = (spectrum.conj().T * weights @ spectrum).real / (2 * count)
    return smoothed


def _quadratic_spectral(lags: NDArray[np.float64]) -> NDArray[np.float64]:
    z = np.maximum(6 * np.pi / 5 * lags, 1e-4).clip(max=1e8)
    values: NDArray[np.float64] = 3 / z**2 * (np.sin(z) / z - np.cos(z))
    return np.where(lags == 0, 1.0, values)
