"""`autd-trials calibrate` from files, as a person types it; and what a rig makes of the result."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
import yaml

from autd_trials.calibration.file import load_calibration
from autd_trials.calibration.provenance import Capture, Origin, sidecar_path, sidecar_text
from autd_trials.calibration.track import Track
from tests.calibration.full_disk import largest_file
from tests.calibration.scenes import Scene, cube, record, scene, write_track, write_tracks
from tests.commands.conftest import Run, WriteRig

AROUND = scene(0, 75)


@pytest.fixture
def tracks(tmp_path: Path) -> list[str]:
    return write_tracks(record(AROUND, 0.5, 15, np.random.default_rng(1), clock_offset_s=0.02), tmp_path)


def test_tracks_give_a_calibration_a_report_and_a_picture(
    run: Run, tmp_path: Path, tracks: list[str]
) -> None:
    out = tmp_path / "calibration.yaml"
    result = run("calibrate", "--points", *tracks, "--out", out, "--json")
    assert result.code == 0
    energy = result.json["predicted_energy"]
    assert 0 < energy["low"] <= energy["mean"] <= energy["high"] <= 1.001
    assert "no mounts were given" in result.err
    written = yaml.safe_load(out.read_text())
    assert set(written["inputs"]) == set(tracks)
    assert written["settings"]["clock_offset_s of unit 2"] == pytest.approx(0.02, abs=0.003)
    assert np.array(written["units"][1]["translation_mm"]) == pytest.approx(
        AROUND.motions[1].translation_mm, abs=2
    )
    assert (tmp_path / "calibration.png").stat().st_size > 10_000
    assert "<svg" in (tmp_path / "calibration.svg").read_text()


def test_a_second_calibration_does_not_overwrite_the_first(
    run: Run, tmp_path: Path, tracks: list[str]
) -> None:
    out = tmp_path / "calibration.yaml"
    assert run("calibrate", "--points", *tracks, "--out", out).code == 0
    before = out.read_bytes()
    result = run("calibrate", "--points", *tracks, "--out", out)
    assert result.code == 2
    assert "exists already" in result.err
    assert out.read_bytes() == before


def test_the_papers_method_pairs_the_nearest(run: Run, tmp_path: Path, tracks: list[str]) -> None:
    out = tmp_path / "calibration.yaml"
    result = run(
        "calibrate", "--points", *tracks, "--out", out, "--method", "paper", "--mad-factor", "0.6475"
    )
    assert result.code == 0
    settings = yaml.safe_load(out.read_text())["settings"]
    assert settings["pairing"] == "nearest"
    assert settings["mad_factor"] == 0.6475


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--wand", "w.csv"], "--wand and --wand-length-mm belong together"),
        (["--wand", "w.csv", "--wand-length-mm", "300"], "--wand names 1 files for 2 units"),
        (["--names", "a"], "--names gives 1 names for 2 units"),
        (["--method", "paper", "--range-bias"], "knows no errors of the range"),
        (["--mad-factor", "0.67"], "belongs to the paper's method"),
        (["--measured-by", "motion capture"], "--measured-by and --taken belong together"),
        (["--measured-by", "", "--taken", "2026-11-20T00:00Z"], "--measured-by has 0 letters"),
        (["--measured-by", "x", "--taken", "2999-01-01T00:00Z"], "lies in the future"),
        (["--measured-by", "x", "--taken", "9999-12-31T23:59-14:00"], "lies in the future"),
        (["--names", "a", "b" * 300], "(300 letters)"),
        (["--names", "a", "a"], "a name of its own"),
        (["--names", "a", "b\n"], "printable letters"),
    ],
)
def test_contradictions_are_refused(
    run: Run, tmp_path: Path, tracks: list[str], more: list[str], message: str
) -> None:
    result = run("calibrate", "--points", *tracks, "--out", tmp_path / "c.yaml", *more)
    assert result.code == 2
    assert message in result.err
    assert not (tmp_path / "c.yaml").exists()


def test_one_track_is_not_enough(run: Run, tmp_path: Path, tracks: list[str]) -> None:
    result = run("calibrate", "--points", tracks[0], "--out", tmp_path / "c.yaml")
    assert result.code == 2
    assert "this is 1 unit" in result.err


def test_mounts_of_other_units_are_refused(run: Run, tmp_path: Path, tracks: list[str]) -> None:
    mounts = tmp_path / "mounts.yaml"
    row = {"rotation": np.eye(3).tolist(), "translation_mm": [0, 0, 0]}
    mounts.write_text(yaml.safe_dump({"source": "drawing", "mounts": [{"unit": "left", **row}]}))
    result = run("calibrate", "--points", *tracks, "--out", tmp_path / "c.yaml", "--mounts", mounts)
    assert result.code == 2
    assert "these are mounts of left; the units are unit 1, unit 2" in result.err


def test_a_wand_corrects_the_scale(run: Run, tmp_path: Path) -> None:
    generator = np.random.default_rng(2)
    long = [Track(t.name, t.time_s, t.points_mm * 1.02) for t in record(AROUND, 0.5, 30, generator)]
    middles, directions = cube(80, 400, generator), generator.standard_normal((80, 3))
    half = 150 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    wands = []
    for unit in (0, 1):
        ends = [AROUND.seen(middles + side * half, unit, generator, scale=0.02) for side in (1, -1)]
        path = tmp_path / f"wand{unit}.csv"
        np.savetxt(
            path, np.hstack(ends), delimiter=",", header="ax_mm,ay_mm,az_mm,bx_mm,by_mm,bz_mm", comments=""
        )
        wands.append(path)
    out = tmp_path / "calibration.yaml"
    paths = write_tracks(long, tmp_path)
    result = run(
        "calibrate", "--points", *paths, "--out", out, "--wand", *wands, "--wand-length-mm", 300, "--json"
    )
    assert result.code == 0
    error = result.json["units"][0]["range_error"]
    assert error["scale"] == pytest.approx(0.02, abs=4 * error["scale_sd"])
    found = np.array(yaml.safe_load(out.read_text())["units"][1]["translation_mm"])
    assert found == pytest.approx(AROUND.motions[1].translation_mm, abs=8)


def test_a_silent_unit_is_told(run: Run, tmp_path: Path, tracks: list[str]) -> None:
    nothing = Track("unit 2", np.empty(0), np.empty((0, 3)))
    silent = write_track(nothing, tmp_path / "silent.csv")
    result = run("calibrate", "--points", tracks[0], silent, "--out", tmp_path / "c.yaml")
    assert result.code == 2
    assert "silent.csv: unit 2 saw the target 0 times" in result.err


def test_a_rig_refuses_a_calibration_that_promises_too_little(
    run: Run, tmp_path: Path, tracks: list[str], write_rig: WriteRig
) -> None:
    out = tmp_path / "measured.yaml"
    assert run("calibrate", "--points", *tracks, "--out", out).code == 0

    def rig(least: float, file: Path | None = out) -> Path:
        def change(content: dict[str, dict[str, object]], _calibration: object) -> None:
            content["calibration"]["least_energy_left"] = least
            if file is not None:
                content["calibration"]["file"] = str(file)

        return write_rig(change)

    promised = load_calibration(out)[0].predicted_energy
    assert promised is not None
    assert run("check", "pilot", "--rig", rig(0.9 * promised.low)).code in (0, 5)
    refused = run("check", "pilot", "--rig", rig(1.0))
    assert refused.code == 2
    assert "of the energy at the target (5 % quantile" in refused.err
    made_up = run("check", "pilot", "--rig", rig(0.5, None))
    assert made_up.code == 2
    assert "does not predict the energy" in made_up.err


OUTSIDE = ("--measured-by", "motion capture", "--taken", "2026-11-25T09:00:00+01:00")


def mounts_file(tmp_path: Path, *, made_up: bool) -> Path:
    path = tmp_path / f"mounts-{made_up}.yaml"
    mounts = [
        {"unit": unit, "rotation": np.eye(3).tolist(), "translation_mm": [0, 0, 0]}
        for unit in ("unit 1", "unit 2")
    ]
    path.write_text(yaml.safe_dump({"source": "drawing", "made_up": made_up, "mounts": mounts}))
    return path


def said_by(tmp_path: Path, tracks: list[str], *origins: Origin) -> None:
    """Put beside each track where it comes from."""
    for path, origin in zip(map(Path, tracks), origins, strict=True):
        capture = Capture(origin=origin, sensor="camera", serial=path.stem, taken=TAKEN)
        sidecar_path(path).write_text(sidecar_text(capture, path.read_bytes()))


TAKEN = datetime(2026, 11, 24, 9, tzinfo=UTC)


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the picture, which takes most of the time."""
    name = "autd_trials.calibration.report_figure.draw_calibration"
    monkeypatch.setattr(name, lambda _solution, stem: [stem.with_suffix(".png")])


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    ("origins", "made_up_mounts", "stated", "origin"),
    [
        (None, None, False, "unknown"),
        (None, False, True, "measured"),
        (("measured", "measured"), False, False, "measured"),
        (("measured", "measured"), True, False, "made up"),
        (("measured", "simulated"), False, True, "simulated"),
    ],
)
def test_a_calibration_is_as_real_as_the_worst_of_its_files_and_a_real_rig_takes_real_ones_only(
    run: Run,
    tmp_path: Path,
    tracks: list[str],
    write_rig: WriteRig,
    origins: tuple[Origin, Origin] | None,
    made_up_mounts: bool | None,
    stated: bool,
    origin: Origin,
) -> None:
    if origins is not None:
        said_by(tmp_path, tracks, *origins)
    more = OUTSIDE if stated else ()
    mounts = () if made_up_mounts is None else ("--mounts", mounts_file(tmp_path, made_up=made_up_mounts))
    out = tmp_path / "c.yaml"
    result = run("calibrate", "--points", *tracks, "--out", out, *more, *mounts)
    assert result.code == 0
    written = yaml.safe_load(out.read_text())
    assert written["origin"] == origin
    assert written["made_up"] == (origin in ("simulated", "made up"))
    assert [each["file"] for each in written["sources"]] == list(written["inputs"])
    if origins is not None and "unknown" not in origins:
        assert datetime.fromisoformat(written["taken"]) == TAKEN

    def make_real(rig: dict[str, dict[str, object]], _calibration: object) -> None:
        rig["array"]["link"] = {"interface": "none0"}
        rig["calibration"]["file"] = str(out)

    checked = run("check", "pilot", "--rig", write_rig(make_real))
    refused = f"this calibration is {'of unknown origin' if origin == 'unknown' else origin}" in checked.err
    assert refused == (origin != "measured")
    assert checked.code == 5 if refused else True


@pytest.mark.parametrize("name", ["c" * 300 + ".yaml", "none/c.yaml", "unit1.csv/c.yaml"])
def test_a_name_that_no_file_can_have_is_told_before_anything_is_computed(
    run: Run, tmp_path: Path, tracks: list[str], name: str
) -> None:
    result = run("calibrate", "--points", *tracks, "--out", tmp_path / name)
    assert result.code == 2
    assert "the calibration cannot be written" in result.err


def test_a_picture_that_is_there_is_not_overwritten(run: Run, tmp_path: Path, tracks: list[str]) -> None:
    (tmp_path / "c.png").write_text("of another calibration")
    result = run("calibrate", "--points", *tracks, "--out", tmp_path / "c.yaml")
    assert result.code == 2
    assert "this picture exists already" in result.err
    assert not (tmp_path / "c.yaml").exists()


@pytest.mark.parametrize(("size", "left"), [(500, []), (10_000, ["c.yaml"])])
def test_a_full_disk_leaves_a_whole_calibration_or_none(
    run: Run, tmp_path: Path, tracks: list[str], size: int, left: list[str]
) -> None:
    before = set(tmp_path.iterdir())
    with largest_file(size):
        result = run("calibrate", "--points", *tracks, "--out", tmp_path / "c.yaml")
    assert result.code == (4 if left else 2)
    assert "cannot be written" in result.err or "only its picture is missing" in result.err
    new = {path.name for path in set(tmp_path.iterdir()) - before}
    assert {name for name in new if name.endswith(".yaml")} == set(left)
    if left:
        load_calibration(tmp_path / "c.yaml")


PAIRS_HEADER = "x1_mm,y1_mm,z1_mm,x2_mm,y2_mm,z2_mm"


def write_pairs(path: Path, rows: np.ndarray, header: str = PAIRS_HEADER) -> Path:
    np.savetxt(path, rows, delimiter=",", header=header, comments="")
    return path


@pytest.fixture
def three_units() -> tuple[Scene, list[np.ndarray]]:
    """Three units, and the same points as units 1 and 2, and 1 and 3, have them."""
    around, generator = scene(0, 75, -60), np.random.default_rng(3)
    points = cube(200, 400, generator)
    return around, [
        np.hstack([around.seen(points, unit, generator) for unit in (0, other)]) for other in (1, 2)
    ]


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("way", [(), ("--viewpoint",), ("--method", "paper")])
def test_pairs_without_times_give_a_calibration(
    run: Run, tmp_path: Path, three_units: tuple[Scene, list[np.ndarray]], way: tuple[str, ...]
) -> None:
    around, rows = three_units
    paths = [write_pairs(tmp_path / f"pairs{number}.csv", each) for number, each in enumerate(rows)]
    out = tmp_path / "c.yaml"
    result = run("calibrate", "--pairs", *paths, "--out", out, *OUTSIDE, *way, "--json")
    assert result.code == 0
    written = load_calibration(out)[0]
    assert [unit.name for unit in written.units] == ["unit 1", "unit 2", "unit 3"]
    for unit, motion in zip(written.units, around.motions, strict=True):
        assert unit.translation_mm == pytest.approx(motion.translation_mm, abs=4)
    assert [(each.what, each.sensor) for each in written.sources] == [("pairs", "motion capture")] * 2
    assert written.origin == "measured"
    assert not any("clock_offset" in name for name in written.settings)


@pytest.mark.parametrize(
    ("factor", "count", "header", "message"),
    [
        (1, 3, PAIRS_HEADER, "there are 3 pairs of points"),
        (0.001, 50, PAIRS_HEADER, "looks like metres"),
        (1, 50, "a,b,c,d,e,f", "the columns x1_mm, y1_mm, z1_mm, x2_mm, y2_mm, z2_mm are missing"),
        (1e305, 50, PAIRS_HEADER, "x1_mm"),
    ],
)
def test_wrong_pairs_are_told(
    run: Run,
    tmp_path: Path,
    three_units: tuple[Scene, list[np.ndarray]],
    factor: float,
    count: int,
    header: str,
    message: str,
) -> None:
    path = write_pairs(tmp_path / "pairs.csv", factor * three_units[1][0][:count], header)
    result = run("calibrate", "--pairs", path, "--out", tmp_path / "c.yaml")
    assert result.code == 2
    assert message in result.err


def test_what_belongs_to_times_is_refused_with_pairs(run: Run, tmp_path: Path) -> None:
    result = run("calibrate", "--pairs", "p.csv", "--pairing", "nearest", "--out", tmp_path / "c.yaml")
    assert result.code == 2
    assert "points without times are paired already" in result.err
