"""How much sums over noise scatter that may be correlated in time: the long-run covariance."""

import numpy as np
from numpy.typing import NDArray

_SMALLEST_VALUE = 1e-9  # of the largest: what the rows do not see at all
_TINY = 1e-300


def long_run_covariance(
    residuals: NDArray[np.float64], derivatives: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float]:
    """Return the covariance of the summed products of residuals and derivatives, and how many terms count.

    Were the residuals independent in time, the sum of the products' outer products would do, whatever their
    sizes and shape. Their autocorrelation is described by one autoregression of all components (Berk, 1974,
    Annals of Statistics 2, 489), whose order follows from Akaike's criterion: slow noise below white noise is
    seen too. By how much that enlarges the covariance depends on how fast the derivatives change, and follows
    from both spectra. The result is never smaller than for independent residuals, and larger the more of the
    slow noise the fit can have taken for its parameters.

    Parameters
    ----------
    residuals
        In the order of time, shape (n, r), with mean 0; zeros where there is none.
    derivatives
        Of the residuals, shape (n, r, p); zeros where there is none.

    Returns
    -------
    tuple[NDArray[np.float64], float]
        The covariance, shape (p, p), and how many independent rows would say as much.
    """
    products = np.einsum("nrp,nr->np", derivatives, residuals)
    alone = products.T @ products
    flat = derivatives.reshape(-1, derivatives.shape[2])
    sizes = np.sqrt((flat**2).sum(axis=0)) + _TINY
    values, axes = np.linalg.eigh(flat.T @ flat / np.outer(sizes, sizes))
    kept = values > _SMALLEST_VALUE * values.max()
    lengths = np.sqrt(values[kept])
    whitening = axes[:, kept] / lengths / sizes[:, None]
    inflation, turned = np.linalg.eigh(_correlated(derivatives @ whitening, _autoregression(residuals)))
    inflation = inflation.clip(1)
    back = sizes[:, None] * axes[:, kept] * lengths
    roots = back @ (turned * np.sqrt(inflation)) @ (whitening @ turned).T
    rows = float(residuals.any(axis=1).sum())
    counted = rows / float(inflation.mean())
    hidden = kept.sum() * (1 - counted / max(rows, 1.0))  # slow noise that the fit took for its parameters
    covariance: NDArray[np.float64] = roots @ alone @ roots.T * (counted / max(counted - hidden, 1.0))
    return covariance, counted


def _correlated(derivatives: NDArray[np.float64], coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the covariance of summed products with an autoregression of variance 1, shape (p, p)."""
    count = len(derivatives)
    response = np.fft.rfft(np.append(1.0, -coefficients), 4 * count)
    correlations = np.fft.irfft(1 / np.maximum(np.abs(response) ** 2, _TINY))[:count]
    correlations = correlations / correlations[0]
    power = np.fft.rfft(np.concatenate([correlations, [0.0], correlations[:0:-1]])).real.clip(0)
    power[1:-1] *= 2  # the other half of the spectrum
    spectra = np.fft.rfft(derivatives, 2 * count, axis=0)
    flat = (spectra * np.sqrt(power)[:, None, None]).reshape(-1, derivatives.shape[2])
    covariance: NDArray[np.float64] = (flat.conj().T @ flat).real / (2 * count)
    return covariance


def _autoregression(residuals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the coefficients of an autoregression by Levinson and Durbin, of Akaike's order."""
    count = len(residuals)
    spectrum = (np.abs(np.fft.rfft(residuals, 2 * count, axis=0)) ** 2).sum(axis=1)
    covariances = np.fft.irfft(spectrum)[:count]
    variance, criterion, least = covariances[0], 0.0, 0.0
    best, coefficients = np.empty(0), np.empty(0)
    for order in range(1, min(int(10 * np.log10(max(count, 1))), count // 4) + 1):
        expected = coefficients @ covariances[order - 1 : 0 : -1]
        reflection = float((covariances[order] - expected) / (variance + _TINY))
        coefficients = np.append(coefficients - reflection * coefficients[::-1], reflection)
        variance *= 1 - reflection**2
        criterion += 3 * count * float(np.log(max(1 - reflection**2, _TINY))) + 2  # three coordinates a row
        if criterion < least:
            least, best = criterion, coefficients
    return best
