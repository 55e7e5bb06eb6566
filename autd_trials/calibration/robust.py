"""Registration of two point sets with gross outliers: the paper's way, and one that holds to 60 % of them."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autd_trials.array.geometry import Vectors
from autd_trials.calibration.rigid import RigidMotion, Weights, fit_rigid

NORMAL_MAD_FACTOR = 0.6745
"""Median of |x| of a standard normal variable; the paper's equation 10 prints 0.6475."""

PRINTED_MAD_FACTOR = 0.6475

_MOST_ITERATIONS = 100
_CONVERGED = 1e-9
_SAMPLES = 600  # of 3 pairs; with 60 % outliers all of them hold one with a chance of 1e-17
_JUDGES = 500  # pairs at most that samples are compared by
_LEAST_SHARE = 0.35  # of the pairs that are taken to be right when samples are compared
_GATE_SD = 3.4  # per axis: 99 % of three normal errors lie within
_SMALLEST_GATE_MM = 0.5


@dataclass(frozen=True, eq=False)
class Registration:
    """A motion from one unit's frame to another's, which pairs it rests on, and their scatter per axis."""

    motion: RigidMotion
    inliers: NDArray[np.bool_]
    noise_mm: float


def register_as_the_paper(
    source_mm: Vectors, target_mm: Vectors, mad_factor: float = NORMAL_MAD_FACTOR
) -> tuple[RigidMotion, Weights]:
    """Return the motion and the weights by the paper's equations 1 to 10: SVD with Tukey's biweight.

    Parameters
    ----------
    source_mm, target_mm
        Paired points in mm, shape (n, 3).
    mad_factor
        By which the median distance is divided; `PRINTED_MAD_FACTOR` repeats the misprint.
    """
    weights = np.ones(len(source_mm))
    motion = fit_rigid(source_mm, target_mm, weights)
    for _ in range(_MOST_ITERATIONS):
        distances_mm = np.linalg.norm(target_mm - motion.apply(source_mm), axis=1)
        gate_mm = max(2 * float(np.median(distances_mm)) / mad_factor, 1e-12)
        new = np.where(distances_mm < gate_mm, (1 - (distances_mm / gate_mm) ** 2) ** 2, 0.0)
        settled = np.abs(new - weights).max() < _CONVERGED
        weights = new
        motion = fit_rigid(source_mm, target_mm, weights)
        if settled:
            break
    return motion, weights


def register_robustly(
    source_mm: Vectors, target_mm: Vectors, generator: np.random.Generator, start: RigidMotion | None = None
) -> Registration:
    """Return a motion that up to 60 % of arbitrarily wrong pairs do not spoil.

    The best of 600 motions through three random pairs, judged by the 35 % quantile of the distances, is
    refined with the pairs inside a gate of 3.4 standard deviations, estimated from those pairs until both
    settle. No noise level has to be known.

    Parameters
    ----------
    source_mm, target_mm
        Paired points in mm, shape (n, 3), at least 3.
    generator
        Where the samples come from.
    start
        A motion that is nearly right already, in place of samples.
    """
    motion = start or _best_sample(source_mm, target_mm, generator)
    distances_mm = np.linalg.norm(target_mm - motion.apply(source_mm), axis=1)
    inliers = distances_mm <= np.quantile(distances_mm, _LEAST_SHARE)
    noise_mm = 0.0
    for _ in range(_MOST_ITERATIONS):
        motion = fit_rigid(source_mm[inliers], target_mm[inliers])
        distances_mm = np.linalg.norm(target_mm - motion.apply(source_mm), axis=1)
        noise_mm = _noise_mm(distances_mm)
        new = distances_mm <= max(_GATE_SD * noise_mm, _SMALLEST_GATE_MM)
        if (new == inliers).all() or new.sum() < 3:
            break
        inliers = new
    return Registration(motion, inliers, noise_mm)


def _best_sample(source_mm: Vectors, target_mm: Vectors, generator: np.random.Generator) -> RigidMotion:
    triples = generator.integers(0, len(source_mm), (_SAMPLES, 3))
    ordered = np.sort(triples, axis=1)
    triples = triples[(np.diff(ordered, axis=1) > 0).all(axis=1)]
    motions = fit_rigid(source_mm[triples], target_mm[triples])
    judges = generator.permutation(len(source_mm))[:_JUDGES]
    moved = source_mm[judges] @ motions.rotation.transpose(0, 2, 1) + motions.translation_mm[:, None]
    squares = ((moved - target_mm[judges]) ** 2).sum(axis=-1)
    rank = int(_LEAST_SHARE * (len(judges) - 1))
    best = int(np.partition(squares, rank, axis=1)[:, rank].argmin())
    return RigidMotion(motions.rotation[best], motions.translation_mm[best])


def _noise_mm(distances_mm: NDArray[np.float64]) -> float:
    """Estimate the scatter per axis of the right pairs among all, without knowing how many those are.

    Starts from the 35 % quantile, as if all were right, and takes in what lies within the gate; a distance is
    the length of three normal errors, of which the gate cuts 1 % off.
    """
    noise_mm = float(np.quantile(distances_mm, _LEAST_SHARE)) / 1.26  # the 35 % quantile of chi_3 is 1.28
    for _ in range(_MOST_ITERATIONS):
        inside = distances_mm[distances_mm <= _GATE_SD * max(noise_mm, _SMALLEST_GATE_MM / _GATE_SD)]
        if len(inside) == 0:
            return noise_mm
        new = math.sqrt(float((inside**2).mean()) / 3) * 1.02  # what the gate cut off
        if abs(new - noise_mm) < _CONVERGED:
            break
        noise_mm = new
    return noise_mm
