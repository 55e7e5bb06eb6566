"""The field solver against its peers: one table in one run.

    python tests/benchmarks/bench_field.py [--install-peers] [--plot FILE.png]

4482 sources (two units, 75 degrees, focused on B) and 400 x 400 points of the xz plane, or some of them where
a peer is too slow. Prints millions of source-point pairs per CPU second (threads added up) and the largest
error relative to the peak against the same physics in float64; then a volume of 100^3 points, and how time
grows with points and sources. Must show: points at least 6 times, tiles at least 25 times the SDK's own
simulation, errors under 1e-4. AcousTools and levitate need an environment of their own, which --install-peers
makes.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
import venv
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from autd3 import Duration
from autd3.commands import FixedCompletionTime, Pattern, SetSilencer
from autd3.geometry import Autd3, Geometry
from autd3_core import Velocity
from autd3_emulator import Emulator, Recorder, RmsRecordOption
from autd3_emulator import Grid as EmulatorGrid
from autd3_pattern import PhaseBuffer
from scipy.spatial.transform import Rotation

from autd_trials.acoustics.air import Air
from autd_trials.acoustics.field import Pressures, grid_pressure, pressure
from autd_trials.acoustics.grid import Grid, box_grid
from autd_trials.acoustics.reference import reference_pressure
from autd_trials.acoustics.sources import Medium, Sources, Vectors
from autd_trials.array.emission import focused_sources
from autd_trials.array.focus import PHASE_STEPS
from autd_trials.calibration.file import load_calibration
from autd_trials.yamlfile.shipped import find_file

PEER = "autd3-emulator"
LEAST_RATIOS = {"this project, points": 6.0, "this project, tiles": 25.0}
LARGEST_ERROR = 1e-4
PEERS_PYTHON = Path(".venv-peers/bin/python")
PEERS_LIST = Path(__file__).with_name("peers.txt")
FOCUS_MM = (302.0, 225.0, 1000.0)
SPEED_M_S = 343.2


@dataclass(frozen=True)
class Row:
    """A solver's speed and error."""

    name: str
    pairs: int
    cpu_s: float
    error: float

    @property
    def mpairs_per_cpu_s(self) -> float:
        """Millions of pairs per CPU second."""
        return self.pairs / self.cpu_s / 1e6


def main() -> int:
    """Measure all that is there; return 1 if what must be shown is not."""
    options = _options()
    if options.install_peers:
        _install_peers()
    sources, medium = _sources(), Medium.of(Air())
    grid = box_grid(np.array(FOCUS_MM), np.eye(3)[[0, 2]], width_mm=399, step_mm=1.0)
    rows = [*_own(sources, medium, grid), _emulator(sources, grid), *_peers(sources, grid)]
    _print_table(rows)
    _print_volume(sources, medium)
    _print_scaling(sources, medium, options.plot)
    by_name = {row.name: row for row in rows}
    enough = all(
        by_name[name].mpairs_per_cpu_s >= ratio * by_name[PEER].mpairs_per_cpu_s
        and by_name[name].error <= LARGEST_ERROR
        for name, ratio in LEAST_RATIOS.items()
    )
    print(f"points >= 6 x, tiles >= 25 x the SDK's simulation, error <= 1e-4: {enough}")
    return 0 if enough else 1


def _own(sources: Sources, medium: Medium, grid: Grid) -> list[Row]:
    points_mm = grid.points_mm
    some = np.random.default_rng(1).choice(len(points_mm), 2000, replace=False)
    wanted = reference_pressure(sources, medium, points_mm[some])
    peak = float(np.abs(pressure(sources, medium, np.array([FOCUS_MM])))[0])

    def row(name: str, solve: Callable[[], Pressures], points: int, at: Vectors | None) -> Row:
        found, cpu_s = _timed(solve)
        error = 0.0 if at is None else float(np.abs(found.ravel()[some] - wanted).max() / peak)
        return Row(name, points * sources.phases_turns.size, cpu_s, error)

    few = points_mm[some]
    return [
        row("this project, tiles", lambda: grid_pressure(sources, medium, grid), len(points_mm), points_mm),
        row("this project, points", lambda: pressure(sources, medium, points_mm), len(points_mm), points_mm),
        row("this project, reference", lambda: reference_pressure(sources, medium, few), len(few), None),
    ]


def _emulator(sources: Sources, grid: Grid) -> Row:
    """The SDK's simulation: rms pressure, no directivity, no absorption."""
    phases = np.round(sources.phases_turns * PHASE_STEPS).astype(np.int64) % PHASE_STEPS
    devices = [
        Autd3(o, Rotation.from_matrix(r)) for o, r in zip(sources.origins_mm, sources.rotations, strict=True)
    ]

    def emit(recorder: Recorder) -> None:
        fast = FixedCompletionTime(
            intensity=Duration.from_micros(25), phase=Duration.from_micros(25), strict_mode=False
        )
        recorder.send(SetSilencer(fast))
        recorder.send(Pattern(PhaseBuffer.from_array(phases.astype(np.uint8)), 255))
        recorder.tick(Duration.from_millis(3))

    record = Emulator(Geometry(devices)).record(emit)
    first, last = grid.points_mm[0], grid.points_mm[-1]
    option = RmsRecordOption(sound_speed=Velocity.from_m_s(SPEED_M_S))
    area = EmulatorGrid(x=(first[0], last[0]), y=first[1], z=(first[2], last[2]), resolution=1.0, order="xyz")
    field = record.sound_field(area, option)
    places_mm = field.observe_points().to_numpy()
    field.skip(Duration.from_millis(2))
    begin_s = time.process_time()
    frames = field.next(Duration.from_millis(1))
    cpu_s = time.process_time() - begin_s
    values = frames.to_numpy()
    plain = Medium(SPEED_M_S, 0.0, (1.0,))
    wanted = np.abs(pressure(sources, plain, places_mm)) / np.sqrt(2)
    error = float(np.abs(values[:, -1] - wanted).max() / wanted.max())
    return Row(PEER, values.size * sources.phases_turns.size, cpu_s, error)


def _peers(sources: Sources, grid: Grid) -> list[Row]:
    if not PEERS_PYTHON.exists():
        print("AcousTools and levitate are not installed: run this with --install-peers once")
        return []
    normals = np.repeat(sources.rotations[:, :, 2], sources.places_mm.shape[0], axis=0)
    with tempfile.TemporaryDirectory() as folder:
        problem = Path(folder, "problem.npz")
        np.savez(
            problem,
            positions_mm=sources.positions_mm.reshape(-1, 3),
            normals=normals,
            phases_turns=sources.phases_turns.ravel(),
            points_mm=grid.points_mm,
        )
        return [_peer(name, problem) for name in ("numpy float64", "levitate", "AcousTools")]


def _peer(name: str, problem: Path) -> Row:
    script = Path(__file__).with_name("field_peers.py")
    done = subprocess.run([PEERS_PYTHON, script, name, problem], capture_output=True, text=True, check=True)
    found = json.loads(done.stdout.splitlines()[-1])
    return Row(name, int(found["pairs"]), found["cpu_s"], found["error"])


def _print_table(rows: list[Row]) -> None:
    peer = next(row for row in rows if row.name == PEER)
    print(f"{'solver':<26}{'Mpairs / CPU s':>16}{'x ' + PEER:>20}{'error of peak':>16}")
    for row in sorted(rows, key=lambda row: -row.mpairs_per_cpu_s):
        ratio = row.mpairs_per_cpu_s / peer.mpairs_per_cpu_s
        print(f"{row.name:<26}{row.mpairs_per_cpu_s:>16.1f}{ratio:>20.1f}{row.error:>16.1e}")


def _print_volume(sources: Sources, medium: Medium) -> None:
    cube = box_grid(np.array(FOCUS_MM), np.eye(3), width_mm=99, step_mm=1.0)
    grid_pressure(sources, medium, cube)
    begin_s = time.perf_counter()
    found = grid_pressure(sources, medium, cube)
    print(f"volume of {' x '.join(map(str, found.shape))} points: {time.perf_counter() - begin_s:.2f} s")


def _print_scaling(sources: Sources, medium: Medium, plot: Path | None) -> None:
    lines: dict[str, list[tuple[int, float]]] = {"points": [], "tiles": []}
    for side in (25, 50, 100, 200, 400, 800):
        grid = box_grid(np.array(FOCUS_MM), np.eye(3)[[0, 2]], width_mm=200, step_mm=200 / side)
        lines["tiles"].append((len(grid.points_mm), _timed(partial(grid_pressure, sources, medium, grid))[1]))
        if side <= 400:
            some = grid.points_mm
            lines["points"].append((len(some), _timed(partial(pressure, sources, medium, some))[1]))
    for name, line in lines.items():
        print(f"{name}: " + ", ".join(f"{points} in {1000 * cpu_s:.0f} ms" for points, cpu_s in line))
    devices: list[tuple[int, float]] = []
    plane = box_grid(np.array(FOCUS_MM), np.eye(3)[[0, 2]], width_mm=200, step_mm=1.0)
    for count in (1, 2, 4, 9, 18):
        some_devices = Sources(
            sources.origins_mm[:count],
            sources.rotations[:count],
            sources.places_mm,
            sources.phases_turns[:count],
            sources.amplitudes_pa_mm[:count],
        )
        cpu_s = _timed(partial(grid_pressure, some_devices, medium, plane))[1]
        devices.append((some_devices.phases_turns.size, cpu_s))
    print("sources: " + ", ".join(f"{n} in {1000 * cpu_s:.0f} ms" for n, cpu_s in devices))
    if plot is not None:
        _draw_scaling(lines, devices, plot)


def _draw_scaling(
    lines: dict[str, list[tuple[int, float]]], devices: list[tuple[int, float]], plot: Path
) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    for name, line in lines.items():
        left.loglog(*zip(*line, strict=True), "o-", label=name)
    left.set(xlabel="points (4482 sources)", ylabel="CPU time (s)")
    left.legend(frameon=False)
    right.loglog(*zip(*devices, strict=True), "o-")
    right.set(xlabel="sources (201 x 201 points, tiles)", ylabel="CPU time (s)")
    figure.savefig(plot, dpi=150)


def _timed(solve: Callable[[], Pressures]) -> tuple[Pressures, float]:
    """Return the result and the least CPU time of three runs after a first one."""
    solve()
    times_s = []
    for _ in range(3):
        begin_s = time.process_time()
        found = solve()
        times_s.append(time.process_time() - begin_s)
    return found, min(times_s)


def _sources() -> Sources:
    shipped = find_file("emulated", kind="rig", folder="rigs")
    units = load_calibration(shipped.with_name("emulated-calibration.yaml"))[0].unit_poses()
    return focused_sources(units, FOCUS_MM, speed_of_sound_m_s=SPEED_M_S)


def _install_peers() -> None:
    folder = PEERS_PYTHON.parent.parent
    venv.create(folder, with_pip=True)
    packages = [line for line in PEERS_LIST.read_text().splitlines() if line and not line.startswith("#")]
    torch = [package for package in packages if package.startswith("torch")]
    for some in (torch, packages):
        subprocess.run([PEERS_PYTHON, "-m", "pip", "install", "--quiet", *some], check=True)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    parser.add_argument("--install-peers", action="store_true")
    parser.add_argument("--plot", type=Path)
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
