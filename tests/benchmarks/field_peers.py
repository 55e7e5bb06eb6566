"""Other people's field solvers on the benchmark's sources; run by `bench_field.py` in the peers' environment.

    python field_peers.py PEER PROBLEM.npz

The problem holds positions and normals of the transducers, their phases, and points, all in mm and turns.
Prints one JSON object: pairs, CPU seconds, and the largest error relative to the peak against the same
physics summed in float64, after the best complex factor (each has constants of its own).
"""

import json
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

Problem = Any
SPEED_M_S = 343.2
WAVE_NUMBER_PER_MM = 2 * np.pi * 40_000 / SPEED_M_S / 1000


def acoustools(problem: Problem) -> dict[str, float]:
    """AcousTools' propagate, with its piston's directivity."""
    import torch
    from acoustools.Utilities import propagate

    points_mm = problem["points_mm"][:: problem["points_mm"].shape[0] // 400]
    board = torch.tensor(problem["positions_mm"] / 1000, dtype=torch.float32)
    norms = torch.tensor(problem["normals"], dtype=torch.complex64)
    holo = torch.tensor(np.exp(2j * np.pi * problem["phases_turns"]), dtype=torch.complex64).reshape(1, -1, 1)
    points = torch.tensor((points_mm / 1000).T[None], dtype=torch.float32)
    k, radius = 1000 * WAVE_NUMBER_PER_MM, 0.0045

    def solve() -> np.ndarray[Any, Any]:
        field = propagate(holo, points, board=board, norms=norms, k=k, transducer_radius=radius)
        result: np.ndarray[Any, Any] = field.numpy().ravel()
        return result

    def directivity(cosines: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        argument = k * radius * np.sqrt(np.maximum(0, 1 - cosines**2))
        result: np.ndarray[Any, Any] = 1 / 2 - argument**2 / 16 + argument**4 / 384
        return result

    return judged(solve, problem, points_mm, directivity)


def levitate(problem: Problem) -> dict[str, float]:
    """Levitate's point sources."""
    from levitate.materials import air
    from levitate.transducers import PointSource

    air.c = SPEED_M_S
    source = PointSource(freq=40_000)
    points_mm = problem["points_mm"][:: problem["points_mm"].shape[0] // 1600]
    phasors = np.exp(2j * np.pi * problem["phases_turns"])

    def solve() -> np.ndarray[Any, Any]:
        parts = [
            source.pressure_derivs(
                problem["positions_mm"].T / 1000, problem["normals"].T, part.T / 1000, orders=0
            )[0]
            for part in np.array_split(points_mm, 16)
        ]
        return np.concatenate([phasors @ part for part in parts])

    return judged(solve, problem, points_mm, np.ones_like)


def naive_numpy(problem: Problem) -> dict[str, float]:
    """What anyone writes first: numpy, float64, all pairs of some points at once."""
    points_mm = problem["points_mm"][:: problem["points_mm"].shape[0] // 1600]
    phases, positions_mm = 2 * np.pi * problem["phases_turns"], problem["positions_mm"]

    def solve() -> np.ndarray[Any, Any]:
        parts = []
        for part in np.array_split(points_mm, 16):
            distances_mm = np.linalg.norm(part[:, None] - positions_mm, axis=-1)
            parts.append(
                (np.exp(1j * (WAVE_NUMBER_PER_MM * distances_mm + phases)) / distances_mm).sum(axis=1)
            )
        return np.concatenate(parts)

    return judged(solve, problem, points_mm, np.ones_like)


def judged(
    solve: Callable[[], np.ndarray[Any, Any]],
    problem: Problem,
    points_mm: np.ndarray[Any, Any],
    directivity: Callable[[np.ndarray[Any, Any]], np.ndarray[Any, Any]],
) -> dict[str, float]:
    """Time a solver, the best of three, and compare it with its own physics in float64 at 100 points."""
    solve()
    times_s = []
    for _ in range(3):
        begin_s = time.process_time()
        found = solve()
        times_s.append(time.process_time() - begin_s)
    some = np.linspace(0, len(points_mm) - 1, 100).astype(int)
    ways_mm = points_mm[some][:, None] - problem["positions_mm"]
    distances_mm = np.linalg.norm(ways_mm, axis=-1)
    cosines = np.einsum("pti,ti->pt", ways_mm, problem["normals"]) / distances_mm
    phases = WAVE_NUMBER_PER_MM * distances_mm + 2 * np.pi * problem["phases_turns"]
    wanted = (np.exp(1j * phases) / distances_mm * directivity(cosines)).sum(axis=1)
    factor = np.vdot(wanted, found[some]) / np.vdot(wanted, wanted)
    error = np.abs(found[some] / factor - wanted).max() / np.abs(found / factor).max()
    pairs = len(points_mm) * len(problem["positions_mm"])
    return {"pairs": pairs, "cpu_s": min(times_s), "error": float(error)}


PEERS = {"AcousTools": acoustools, "levitate": levitate, "numpy float64": naive_numpy}

if __name__ == "__main__":
    print(json.dumps(PEERS[sys.argv[1]](np.load(sys.argv[2]))))
