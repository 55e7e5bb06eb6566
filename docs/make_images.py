"""Makes the pictures of README and docs, all from simulations: ``make images``."""

import io
import re
import shutil
import tempfile
from pathlib import Path

import numpy as np
import yaml
from autd_analysis.rates import RATES
from autd_analysis.report.writing import write_results
from autd_analysis.results import Results
from autd_analysis.study import analyse
from matplotlib.figure import Figure
from rich.console import Console

from autd_trials.array.geometry import moved
from autd_trials.calibration.file import load_calibration
from autd_trials.calibration.sensors.scene import LoadedScene
from autd_trials.calibration.target import find_target
from autd_trials.cli import main as autd_trials
from autd_trials.console.controls import controls_line
from autd_trials.console.screen import render
from autd_trials.records.log import read_log
from autd_trials.session.events import StimulusStart
from autd_trials.session.standing import standing
from autd_trials.yamlfile.shipped import find_file

_IMAGES = Path(__file__).parent / "images"
_SHOWN_TRIAL = 18
_AFTER_ONSET_S = 0.6
_POSE_ERRORS_MM = (0, 5, 10, 15, 20, 25, 30)
_PARTICIPANTS = 16
_FRAMES = 5400  # three minutes
_COLOURS = {"inner": "#0072B2", "inner_outer": "#D55E00"}
_LINES = {25.0: ":", 50.0: "--", 100.0: "-"}


def main() -> None:
    """Make them all."""
    _IMAGES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        _draw_study(Path(folder))
        _draw_thresholds(Path(folder))
        _draw_power(Path(folder))
        _draw_fields(Path(folder))
        _draw_detection_against_pose_error(Path(folder))
        _draw_calibration(Path(folder))


def _draw_study(folder: Path) -> None:
    """Run the study as `make demo` does; draw its figure, and the screen in the middle of a session."""
    autd_trials(["run", "chest", "--simulate", "8", "--seed", "1", "--data", str(folder)])
    study = folder / "chest"
    write_results(analyse(study), study / "results")
    shutil.copy(study / "results" / "rates.png", _IMAGES / "chest.png")
    _draw_screen(next(study.glob("sourcedata/sub-sim01/*/*_log.jsonl")))


def _draw_thresholds(folder: Path) -> None:
    """Run the shipped adaptive study over simulated participants and draw their thresholds."""
    autd_trials(["run", "chest-threshold", "--simulate", "8", "--seed", "1", "--data", str(folder)])
    study = folder / "chest-threshold"
    write_results(analyse(study), study / "results")
    shutil.copy(study / "results" / "thresholds.png", _IMAGES / "thresholds.png")


def _draw_power(folder: Path) -> None:
    """Draw the power of the paper's study against the number of participants."""
    tests = "sign_flip,paired_t"
    size = ["--participants", "4-24", "--studies", "2000", "--tests", tests]
    autd_trials(["power", "chest", *size, "--out", str(folder / "power")])
    shutil.copy(folder / "power" / "power.png", _IMAGES / "power.png")


def _draw_screen(log: Path) -> None:
    events = read_log(log).events
    shown = next(e for e in events if isinstance(e, StimulusStart) and e.trial == _SHOWN_TRIAL)
    now = standing(events[: events.index(shown) + 1])
    footer = controls_line(answers="space: hand raised", keys=True, attended=True)
    console = Console(record=True, width=110, file=io.StringIO(), force_terminal=True)
    console.print(render(now, shown.onset_t_s + _AFTER_ONSET_S, unblind=False, footer=footer))
    drawing = console.export_svg(title="run-protocol chest.yaml")
    own = re.sub(r"@font-face \{.*?\}", "", drawing, flags=re.DOTALL)  # no fonts from the web
    (_IMAGES / "screen.svg").write_text(own, encoding="utf-8")


def _draw_fields(folder: Path) -> None:
    """Draw the paper's foci, what 20 mm of unit 2 do to B, and the error budget there."""
    autd_trials(["field", "--out", str(folder / "right"), "--error-budget", "200"])
    wrong = ["--focus", "302,225,1000", "--pose-error", "2:0,0,20"]
    autd_trials(["field", "--out", str(folder / "wrong"), *wrong])
    shutil.copy(folder / "right" / "field.png", _IMAGES / "field.png")
    shutil.copy(folder / "right" / "error_budget.png", _IMAGES / "error-budget.png")
    shutil.copy(folder / "wrong" / "field.png", _IMAGES / "field-unit2-20mm.png")


def _draw_calibration(folder: Path) -> None:
    """Let two simulated sensors watch the made-up scene for three minutes, and calibrate by that."""
    scene = LoadedScene(find_file("emulated", kind="scene", folder="scenes"))
    tracks = [str(_watch(scene, unit, folder / f"unit{unit}.csv")) for unit in (1, 2)]
    out = ["--out", str(folder / "calibration.yaml")]
    aim = ["--mounts", "emulated-mounts", "--target", "302,225,1000"]
    autd_trials(["calibrate", "--points", *tracks, *aim, *out])
    shutil.copy(folder / "calibration.png", _IMAGES / "calibration.png")


def _watch(scene: LoadedScene, unit: int, path: Path) -> Path:
    sensor = scene.sensor(unit, np.random.default_rng(unit), start_s=unit / 100, frames=_FRAMES)
    lines = ["t_s,x_mm,y_mm,z_mm"]
    for frame in sensor:
        sighting = find_target(frame, sensor.intrinsics)
        if sighting is not None:
            x, y, z = sighting.point_mm
            lines.append(f"{frame.time_s:.6f},{x:.4f},{y:.4f},{z:.4f}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _draw_detection_against_pose_error(folder: Path) -> None:
    """Simulate the study with unit 2 standing ever further from where the calibration has it."""
    results = {}
    for error_mm in _POSE_ERRORS_MM:
        rig = _write_rig(folder / f"rig{error_mm}", error_mm)
        data = str(folder / f"data{error_mm}")
        autd_trials(["run", "chest", "--simulate", str(_PARTICIPANTS), "--rig", str(rig), "--data", data])
        results[error_mm] = analyse(Path(data, "chest"), only=["rates"])
    figure = Figure(figsize=(9, 4.6), layout="constrained")
    axes = figure.subplots()
    for clothing, colour in _COLOURS.items():
        for modulation_hz, line in _LINES.items():
            rates = [_rate(result, modulation_hz, clothing) for result in results.values()]
            label = f"{clothing.replace('_', ' + ')}, {modulation_hz:g} Hz"
            axes.plot(_POSE_ERRORS_MM, rates, line, marker="o", markersize=4, color=colour, label=label)
    axes.set(
        xlabel="unit 2 stands so many mm beyond where the calibration has it, in z",
        ylabel="detection rate (mean)",
        ylim=(0, 1.02),
        title=f"{_PARTICIPANTS} simulated participants: an assumption, no data",
    )
    axes.grid(axis="y", alpha=0.3)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside right upper", frameon=False, fontsize=8)
    figure.savefig(_IMAGES / "detection-pose-error.png", dpi=150)


def _rate(results: Results, modulation_hz: float, clothing: str) -> float:
    conditions = {"modulation_hz": modulation_hz, "clothing": clothing}
    chosen = [rate for rate in results[RATES].conditions if dict(rate.condition) == conditions]
    return float(chosen[0].mean or 0.0)


def _write_rig(folder: Path, error_mm: float) -> Path:
    """Write the emulated rig with unit 2 really standing elsewhere; return its file."""
    folder.mkdir()
    shipped = find_file("emulated", kind="rig", folder="rigs")
    calibration_file = shipped.with_name("emulated-calibration.yaml")
    unit = load_calibration(calibration_file)[0].unit_poses()[1]
    standing = moved(unit, np.array([0.0, 0.0, error_mm]), np.zeros(3))
    true = yaml.safe_load(calibration_file.read_text(encoding="utf-8"))
    true["units"][1]["translation_mm"] = [float(x) for x in standing.translation_mm]
    (folder / "true.yaml").write_text(yaml.safe_dump(true), encoding="utf-8")
    shutil.copy(calibration_file, folder / "calibration.yaml")
    rig = yaml.safe_load(shipped.read_text(encoding="utf-8"))
    rig["calibration"] = {"file": "calibration.yaml", "true_file": "true.yaml"}
    (folder / "rig.yaml").write_text(yaml.safe_dump(rig), encoding="utf-8")
    return folder / "rig.yaml"


if __name__ == "__main__":
    main()
