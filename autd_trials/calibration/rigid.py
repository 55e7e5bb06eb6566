"""Rigid motions between paired points."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.geometry import Vectors

Weights = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """``p -> rotation @ p + translation_mm``; `rotation` (3, 3), `translation_mm` (3,)."""

    rotation: Vectors
    translation_mm: Vectors

    @classmethod
    def identity(cls) -> Self:
        """Return the motion that moves nothing."""
        return cls(np.eye(3), np.zeros(3))

    def apply(self, points_mm: Vectors) -> Vectors:
        """Return moved points, shape (..., 3)."""
        moved: Vectors = points_mm @ self.rotation.T + self.translation_mm
        return moved

    def after(self, first: "RigidMotion") -> "RigidMotion":
        """Return the motion that does `first` and then this one."""
        return RigidMotion(self.rotation @ first.rotation, self.apply(first.translation_mm))

    def inverse(self) -> "RigidMotion":
        """Return the motion back."""
        return RigidMotion(self.rotation.T, -self.rotation.T @ self.translation_mm)


def fit_rigid(source_mm: Vectors, target_mm: Vectors, weights: Weights | None = None) -> RigidMotion:
    """Return the motion that brings points closest to others in weighted least squares.

    The paper's equations 2 to 7 (Arun, Huang and Blostein, 1987), with the sign that excludes reflections.

    Parameters
    ----------
    source_mm, target_mm
        Paired points in mm, shape (n, 3), or several sets at once, shape (sets, n, 3).
    weights
        Shape (n,); all the same if None.

    Returns
    -------
    RigidMotion
        With a leading axis in both parts for several sets.
    """
    share = np.full(source_mm.shape[-2], 1.0) if weights is None else weights
    share = share / share.sum()
    source_centre = np.einsum("n,...nd->...d", share, source_mm)
    target_centre = np.einsum("n,...nd->...d", share, target_mm)
    covariance = np.einsum(
        "n,...ni,...nj->...ij",
        share,
        source_mm - source_centre[..., None, :],
        target_mm - target_centre[..., None, :],
    )
    left, _, right = np.linalg.svd(covariance)
    signs = np.ones(covariance.shape[:-1])
    signs[..., 2] = np.linalg.det(left) * np.linalg.det(right)
    rotation = np.einsum("...ji,...j,...kj->...ik", right, signs, left)
    return RigidMotion(rotation, target_centre - np.einsum("...ij,...j->...i", rotation, source_centre))
