import csv
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.acoustics.air import Air
from autd_trials.acoustics.grid import Grid, box_grid
from autd_trials.acoustics.reference import reference_pressure
from autd_trials.acoustics.scan import Scan, compare_scan, read_scan, size_mm, write_scan
from autd_trials.acoustics.sources import Medium, Sources
from autd_trials.errors import UsageError

MEDIUM = Medium.of(Air())
FOCUS_MM = np.array([10.0, -5.0, 400.0])


def focused_board() -> Sources:
    """A board of 20 x 20 transducers, focused."""
    places = np.array([(x, y) for x in range(20) for y in range(20)]) * 10.16 - 96.5
    distances = np.linalg.norm(np.column_stack([places, np.zeros(400)]) - FOCUS_MM, axis=1)
    return Sources(
        np.zeros((1, 3)),
        np.eye(3)[None],
        places,
        -distances[None] * MEDIUM.turns_per_mm,
        np.full((1, 400), 4386.0),
    )


def moved_scan(grid: Grid, shift_mm: tuple[float, ...], gain: float = 1.0) -> Scan:
    """What a microphone would find if the field were moved and louder."""
    away = grid.points_mm - np.array(shift_mm)
    rms_pa = gain * np.abs(reference_pressure(focused_board(), MEDIUM, away)) / math.sqrt(2)
    return Scan(grid.points_mm, rms_pa)


@pytest.mark.parametrize(
    ("axes", "shift_mm"),
    [([0, 2], (4.0, 0.0, 17.0)), ([0, 1], (-6.5, 3.0, 0.0)), ([2], (0.0, 0.0, -9.0))],
)
def test_a_known_shift_and_gain_are_found(axes: list[int], shift_mm: tuple[float, ...]) -> None:
    grid = box_grid(FOCUS_MM, np.eye(3)[axes], width_mm=60, step_mm=2)
    found = compare_scan(moved_scan(grid, shift_mm, gain=0.5), focused_board(), MEDIUM)
    assert found.shift_mm == pytest.approx(shift_mm, abs=0.1)
    assert found.level_db == pytest.approx(20 * math.log10(0.5), abs=0.05)
    assert found.residual < 0.01
    assert found.axes_seen == len(axes)


def test_a_shift_in_space_is_found_from_a_volume() -> None:
    grid = box_grid(FOCUS_MM, np.eye(3), width_mm=40, step_mm=8)
    found = compare_scan(moved_scan(grid, (3.3, -1.2, 8.4)), focused_board(), MEDIUM)
    assert found.shift_mm == pytest.approx((3.3, -1.2, 8.4), abs=0.2)


def test_another_field_leaves_a_residual() -> None:
    grid = box_grid(FOCUS_MM, np.eye(3)[[0, 1]], width_mm=60, step_mm=2)
    found = compare_scan(moved_scan(grid, (0, 0, 200)), focused_board(), MEDIUM)
    assert found.residual > 0.1


def test_sizes_are_those_of_the_scanned_points() -> None:
    grid = box_grid(FOCUS_MM, np.eye(3)[[0]], width_mm=60, step_mm=1)
    scan = moved_scan(grid, (0, 0, 0))
    over = grid.points_mm[scan.rms_pa**2 > scan.rms_pa.max() ** 2 / math.sqrt(2), 0]
    found = compare_scan(scan, focused_board(), MEDIUM)
    assert found.size_measured_mm == pytest.approx(np.ptp(over))
    assert found.size_predicted_mm == pytest.approx(np.ptp(over))


@given(counts=st.lists(st.integers(1, 6), min_size=1, max_size=3))
def test_a_robot_goes_from_neighbour_to_neighbour(
    tmp_path_factory: pytest.TempPathFactory, counts: list[int]
) -> None:
    grid = Grid(FOCUS_MM, np.eye(3)[: len(counts)] * 2.0, tuple(counts))
    path = tmp_path_factory.mktemp("scan") / "scan.csv"
    assert write_scan(path, grid, focused_board(), MEDIUM) == math.prod(counts)
    with path.open() as file:
        points = np.array([[float(row[k]) for k in ("x_mm", "y_mm", "z_mm")] for row in csv.DictReader(file)])
    assert len({tuple(point) for point in points}) == math.prod(counts)
    assert np.allclose(np.linalg.norm(np.diff(points, axis=0), axis=1), 2.0)


def test_what_is_written_for_a_robot_is_read_back(tmp_path: Path) -> None:
    grid = box_grid(FOCUS_MM, np.eye(3)[[0, 2]], width_mm=20, step_mm=4)
    write_scan(tmp_path / "scan.csv", grid, focused_board(), MEDIUM)
    found = compare_scan(read_scan(tmp_path / "scan.csv"), focused_board(), MEDIUM)
    assert found.shift_mm == pytest.approx((0, 0, 0), abs=0.1)
    with pytest.raises(UsageError, match="already"):
        write_scan(tmp_path / "scan.csv", grid, focused_board(), MEDIUM)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x_mm,y_mm,p_pa\n1,2,3\n", r"csv:1: the columns z_mm are missing; there are x_mm, y_mm, p_pa"),
        ("", r"csv:1: the scan is empty"),
        ("x_mm,y_mm,z_mm,p_pa\n1,2,3,4\n1,2,x,4\n", r"csv:3: z_mm is 'x'"),
        ("x_mm,y_mm,z_mm,p_pa\n1,2,3,nan\n", r"csv:2: p_pa is 'nan'"),
        ("x_mm,y_mm,z_mm,p_pa\n1,2,3\n", r"csv:2: 3 cells under 4 column names"),
        ("x_mm,y_mm,z_mm,p_pa\n1,2,3,-4\n", r"csv:2: p_pa is -4, but must be at least 0"),
        ("x_mm,y_mm,z_mm,p_pa\n1,2,3,4\n", "the scan has 1 points"),
    ],
)
def test_a_bad_scan_is_told_with_its_line(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "scan.csv"
    path.write_text(text)
    with pytest.raises(UsageError, match=message):
        read_scan(path)


def scan_file(folder: Path, rows: list[str]) -> Path:
    path = folder / "scan.csv"
    path.write_text("\n".join(["x_mm,y_mm,z_mm,p_pa", *rows]) + "\n")
    return path


def test_a_scan_with_decimal_commas_is_refused_beside_commas_and_read_beside_semicolons(
    tmp_path: Path,
) -> None:
    rows = [f"{300 + number},225,1000,{number},5" for number in range(12)]
    with pytest.raises(UsageError, match=r"csv:2: 5 cells under 4 column names\n.*decimal point"):
        read_scan(scan_file(tmp_path, rows))
    path = tmp_path / "scan.csv"
    path.write_text("x_mm;y_mm;z_mm;p_pa\n" + "".join(f"{300 + n};225;1000;{n},5\n" for n in range(12)))
    assert read_scan(path).rms_pa.tolist() == [number + 0.5 for number in range(12)]


@pytest.mark.parametrize("pressure", ["0", "1e-300", "5e-7"])
def test_a_scan_in_which_nothing_was_heard_is_refused(tmp_path: Path, pressure: str) -> None:
    rows = [f"{300 + number},225,1000,{pressure}" for number in range(12)]
    with pytest.raises(UsageError, match="nothing was heard"):
        read_scan(scan_file(tmp_path, rows))


@pytest.mark.parametrize(("place", "message"), [("1e6", "at most 10000"), ("-10001", "at least -10000")])
def test_a_scan_of_places_out_of_reach_is_refused(tmp_path: Path, place: str, message: str) -> None:
    rows = [f"{300 + number},225,1000,1" for number in range(11)]
    with pytest.raises(UsageError, match=rf"csv:13: z_mm is .*, but must be {message}"):
        read_scan(scan_file(tmp_path, [*rows, f"300,225,{place},1"]))


def test_a_scan_that_is_too_wide_to_predict_is_refused_before_the_field_is_computed() -> None:
    corners = np.array(list(np.ndindex(2, 2, 2, 2)))[:, :3] * 9000.0
    with pytest.raises(UsageError, match=r"spans \d+ x \d+ x \d+ mm"):
        compare_scan(Scan(corners, np.ones(16)), focused_board(), MEDIUM)


def test_the_size_of_many_points_is_that_of_all_pairs() -> None:
    from scipy.spatial.distance import pdist

    generator = np.random.default_rng(4)
    for stretch in ((1, 1, 1), (1, 5, 0.1), (0, 0, 3)):
        points_mm = generator.normal(size=(1500, 3)) * stretch
        largest_mm = pdist(points_mm).max()
        assert 0.997 * largest_mm <= size_mm(points_mm, np.ones(1500)) <= largest_mm * (1 + 1e-12)


def test_a_missing_scan_and_one_in_a_single_place(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="cannot be read"):
        read_scan(tmp_path / "none.csv")
    with pytest.raises(UsageError, match="in one place"):
        compare_scan(Scan(np.tile(FOCUS_MM, (12, 1)), np.ones(12)), focused_board(), MEDIUM)
