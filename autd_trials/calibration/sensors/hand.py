"""How a simulated hand waves the target."""

from collections.abc import Callable

import numpy as np

from autd_trials.array.geometry import Vectors

HandPath = Callable[[Vectors], Vectors]
"""From times in s, shape (n,), to places in mm, shape (n, 3)."""

_WAVES = 4
_RATES_HZ = (0.1, 0.6)
_LONG_S = 600.0


def hand_path(
    centre_mm: Vectors, half_mm: float, mean_speed_mm_s: float, generator: np.random.Generator
) -> HandPath:
    """Return a smooth path for ever: sums of four sines an axis, none of them in step with another.

    Parameters
    ----------
    centre_mm
        The workspace's centre, shape (3,).
    half_mm
        How far the hand goes along each axis.
    mean_speed_mm_s
        Mean speed.
    generator
        Where rates, phases and sizes come from.
    """
    rates = generator.uniform(*_RATES_HZ, (3, _WAVES))
    phases = generator.uniform(0, 2 * np.pi, (3, _WAVES))
    sizes = generator.uniform(0.5, 1.0, (3, _WAVES))
    sizes_mm = half_mm * sizes / sizes.sum(axis=1, keepdims=True)

    def offsets_mm(time_s: Vectors) -> Vectors:
        waves: Vectors = sizes_mm * np.sin(2 * np.pi * rates * time_s[:, None, None] + phases)
        total: Vectors = waves.sum(axis=2)
        return total

    dense_s = np.arange(0, _LONG_S, 0.01)
    speed_mm_s = float(np.linalg.norm(np.diff(offsets_mm(dense_s), axis=0), axis=1).mean() / 0.01)
    pace = mean_speed_mm_s / speed_mm_s
    return lambda time_s: centre_mm + offsets_mm(time_s * pace)
