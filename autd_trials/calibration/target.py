"""The target in a frame: a small retroreflective body that shines in the infrared image."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.geometry import Vectors
from autd_trials.calibration.sensors.frame import Frame, Intrinsics

RADIUS_MM = 5 + 10 / np.sqrt(2)
"""From a square face to the centre of the paper's rhombicuboctahedron of 10 mm edges: 12.07 mm."""

_BRIGHTER_SD = 12.0  # over the background's scatter
_BRIGHT_SHARE = 0.25  # of the brightest pixel
_FEWEST_PIXELS = 6
_MOST_BLOBS = 1000  # more is noise, not a scene
_SIZE_RATIO = (0.55, 1.8)
_ROUNDEST = 2.0  # largest ratio of a blob's axes
_LEAST_KNOWN_DEPTH = 0.3
_LEAST_QUALITY = 0.2
_MAD_TO_SD = 1.4826
_BACKGROUND_STEP = 4  # every fourth pixel tells enough of the background


@dataclass(frozen=True, eq=False)
class Sighting:
    """The target's centre in mm in the sensor's frame (x right, y down, z forward); quality 0 to 1."""

    point_mm: Vectors
    quality: float


def find_target(frame: Frame, intrinsics: Intrinsics, radius_mm: float = RADIUS_MM) -> Sighting | None:
    """Return the target, or None if nothing in the frame looks like it.

    Bright connected pixels are a candidate if they are as large as the target would be at their depth, round,
    and if their depth is known. The centre is the brightness-weighted mean, the depth the mean of the pixels
    within half the blob's radius (of a sphere, these lie 0.8 mm behind the nearest point). Equation 11 of the
    paper moves the point from the surface to the centre.

    Parameters
    ----------
    frame
        A capture.
    intrinsics
        The sensor's camera.
    radius_mm
        From the target's surface to its centre.
    """
    from scipy import ndimage

    bright = frame.infrared.astype(np.float64)
    threshold = _threshold(bright)
    labels, blobs = ndimage.label(bright > threshold)
    if not 0 < blobs <= _MOST_BLOBS:
        return None
    best: Sighting | None = None
    for label, place in enumerate(ndimage.find_objects(labels), start=1):
        pixels = labels[place] == label
        if pixels.sum() < _FEWEST_PIXELS:
            continue
        sighting = _judge(bright[place], frame.depth_m[place], pixels, place, intrinsics, radius_mm)
        if sighting is not None and (best is None or sighting.quality > best.quality):
            best = sighting
    return best


def _threshold(bright: NDArray[np.float64]) -> float:
    sample = bright[::_BACKGROUND_STEP, ::_BACKGROUND_STEP]
    middle = float(np.median(sample))
    scatter = _MAD_TO_SD * float(np.median(np.abs(sample - middle)))
    return float(
        max(middle + _BRIGHTER_SD * max(scatter, 1.0), middle + _BRIGHT_SHARE * (bright.max() - middle))
    )


def _judge(
    bright: NDArray[np.float64],
    depth_m: NDArray[np.float32],
    pixels: NDArray[np.bool_],
    place: tuple[slice, ...],
    intrinsics: Intrinsics,
    radius_mm: float,
) -> Sighting | None:
    known = pixels & (depth_m > 0)
    share_known = float(known.sum() / pixels.sum())
    if share_known < _LEAST_KNOWN_DEPTH:
        return None
    v, u = np.nonzero(pixels)
    weights = bright[pixels] / bright[pixels].sum()
    u_px, v_px = float(weights @ u) + place[1].start, float(weights @ v) + place[0].start
    size_px = float(np.sqrt(pixels.sum() / np.pi))
    middle = _disc(pixels.shape, u_px - place[1].start, v_px - place[0].start, max(size_px / 2, 1.0))
    depths_m = depth_m[known & middle] if (known & middle).any() else depth_m[known]
    depth_mm = 1000 * float(_near(depths_m).mean())
    ratio = size_px / (intrinsics.fx * radius_mm / (depth_mm + radius_mm))
    if not _SIZE_RATIO[0] < ratio < _SIZE_RATIO[1] or _elongation(u, v) > _ROUNDEST:
        return None
    surface_mm = depth_mm * intrinsics.ray(u_px, v_px)
    length_mm = float(np.linalg.norm(surface_mm))
    quality = share_known / max(ratio, 1 / ratio) ** 2
    if quality < _LEAST_QUALITY:
        return None
    return Sighting((length_mm + radius_mm) / length_mm * surface_mm, round(quality, 4))


def _disc(shape: tuple[int, ...], u: float, v: float, radius_px: float) -> NDArray[np.bool_]:
    rows, columns = np.indices(shape)
    inside: NDArray[np.bool_] = np.hypot(columns - u, rows - v) <= radius_px
    return inside


def _near(depths_m: NDArray[np.float32]) -> NDArray[np.float64]:
    """Leave out pixels at the blob's edge that see the wall behind."""
    middle = np.median(depths_m)
    near: NDArray[np.float64] = depths_m[np.abs(depths_m - middle) < 0.05].astype(np.float64)
    return near


def _elongation(u: NDArray[np.int64], v: NDArray[np.int64]) -> float:
    """Return the ratio of a blob's axes; a single line of pixels counts as long as it is."""
    spread = np.cov(np.stack([u, v]).astype(np.float64)) + np.eye(2) / 12
    smallest, largest = np.linalg.eigvalsh(spread)
    return float(np.sqrt(largest / smallest))
