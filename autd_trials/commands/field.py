"""`autd-trials field`: where the focus is, how large and how strong, before anybody stands there."""

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from autd_trials.calibration.writing import writing
from autd_trials.commands.arguments import Triple, numbers, triple
from autd_trials.commands.output import print_json, print_text, say
from autd_trials.commands.progress import progress_bar
from autd_trials.errors import UsageError

if TYPE_CHECKING:
    from autd_trials.acoustics.air import Air
    from autd_trials.acoustics.focus_metrics import FocusMetrics
    from autd_trials.acoustics.scan import Scan
    from autd_trials.acoustics.sources import Sources
    from autd_trials.array.geometry import UnitPose
    from autd_trials.rig.load import LoadedRig

PAPER_FOCI: dict[str, Triple] = {"A": (302, 225, 500), "B": (302, 225, 1000), "C": (302, 225, 1500)}
"""The foci of the paper's section 4, in mm."""

_PARTS_OF_AN_ERROR = (3, 6)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("--rig", metavar="FILE", default="emulated", help="rig file, or bare name (emulated)")
    parser.add_argument("--calibration", type=Path, metavar="FILE", help="another calibration than the rig's")
    parser.add_argument(
        "--focus",
        type=triple,
        action="append",
        metavar="X,Y,Z",
        help="a focus in mm; may be repeated; --focus=X,Y,Z if X is negative (the paper's A, B and C)",
    )
    parser.add_argument("--drive", type=float, default=1.0, metavar="D", help="0 to 1 (1)")
    parser.add_argument(
        "--pose-error",
        type=_pose_error,
        action="append",
        default=[],
        metavar="UNIT:X,Y,Z[,RX,RY,RZ]",
        help="the unit really stands so many mm (and is turned so many degrees) off; may be repeated",
    )
    parser.add_argument(
        "--error-budget",
        type=int,
        nargs="?",
        const=200,
        metavar="DRAWS",
        help="energy left against pose errors, over so many random directions each (200)",
    )
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="seed of the error budget (1)")
    parser.add_argument(
        "--measured", type=Path, metavar="CSV", help="lay a microphone scan (x_mm,y_mm,z_mm,p_pa) over it"
    )
    parser.add_argument(
        "--scan",
        type=Path,
        metavar="CSV",
        help="write the xz plane for a scanning robot, with the prediction",
    )
    parser.add_argument("--width-mm", type=float, default=100.0, metavar="MM", help="width of planes (100)")
    parser.add_argument("--step-mm", type=float, default=0.5, metavar="MM", help="steps of planes (0.5)")
    parser.add_argument(
        "--out", type=Path, default=Path("field"), metavar="DIR", help="where pictures go (field)"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def execute(options: argparse.Namespace) -> int:
    """Compute the field and write pictures and metrics."""
    from autd_trials.acoustics.scan import read_scan

    if options.error_budget is not None and options.error_budget < 1:
        raise UsageError(f"--error-budget is {options.error_budget}", do="give at least 1 draw")
    bench = _FieldBench.load(options)
    foci = _named_foci(options.focus)
    measured = None if options.measured is None else read_scan(options.measured)
    try:
        options.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(
            f"the folder for pictures cannot be made: {error.strerror}",
            where=str(options.out),
            do="name a folder, not a file",
        ) from error
    with writing(options.out, "free space or name another folder with --out, and compute again"):
        report = _compute(bench, foci, measured, options)
        text = json.dumps(report, indent=1, allow_nan=False) + "\n"
        (options.out / "field.json").write_text(text, encoding="utf-8")
    return _print(report, options)


def _compute(
    bench: "_FieldBench", foci: dict[str, Triple], measured: "Scan | None", options: argparse.Namespace
) -> dict[str, Any]:
    """Draw what was asked for, and return what there is to say of it."""
    report = bench.describe()
    report["foci"] = bench.draw_foci(foci, options)
    first = foci.get("B") or next(iter(foci.values()))
    if options.error_budget is not None:
        report["error_budget"] = bench.draw_budget(first, options)
    if measured is not None:
        report["measured"] = bench.draw_scan(measured, first, options)
    if options.scan is not None:
        report["scan"] = bench.write_scan(first, options)
    return report


@dataclass(frozen=True)
class _FieldBench:
    """A rig's units, where they really stand, and the air."""

    rig: "LoadedRig"
    believed: "list[UnitPose]"
    units: "list[UnitPose]"
    air: "Air"
    drive: float
    pose_errors: Sequence[tuple[int, tuple[float, ...]]]

    @classmethod
    def load(cls, options: argparse.Namespace) -> "_FieldBench":
        from datetime import UTC, datetime

        from autd_trials.rig.load import load_rig, with_calibration

        if not 0 < options.drive <= 1:
            raise UsageError(f"--drive is {options.drive:g}", do="give a drive over 0, at most 1")
        rig = load_rig(options.rig, datetime.now(UTC))
        if options.calibration is not None:
            rig = with_calibration(rig, options.calibration)
        believed = rig.calibration.unit_poses()
        units = _moved(believed, options.pose_error)
        return cls(rig, believed, units, rig.rig.air, options.drive, options.pose_error)

    def sources(self, focus_mm: Triple) -> "Sources":
        from autd_trials.array.emission import focused_sources

        return focused_sources(
            self.units,
            focus_mm,
            speed_of_sound_m_s=self.air.speed_of_sound_m_s,
            drive=self.drive,
            believed=self.believed,
        )

    def describe(self) -> dict[str, Any]:
        return {
            "rig": self.rig.rig.name,
            "calibration_sha256": self.rig.calibration_sha256,
            "calibration_made_up": self.rig.calibration.made_up,
            "drive": self.drive,
            "air": asdict(self.air),
            "pose_errors": [
                {"unit": number, "shift_mm": values[:3], "rotation_deg": values[3:] or (0.0, 0.0, 0.0)}
                for number, values in self.pose_errors
            ],
        }

    def draw_foci(self, foci: dict[str, Triple], options: argparse.Namespace) -> list[dict[str, Any]]:
        import numpy as np

        from autd_trials.acoustics.field_figure import draw_foci, take_picture
        from autd_trials.acoustics.focus_metrics import focus_metrics
        from autd_trials.array.limits import refuse_out_of_reach
        from autd_trials.calibration.pose_error import energy_left

        pictures, described = [], []
        for name, focus_mm in foci.items():
            refuse_out_of_reach(self.believed, focus_mm)
            sources = self.sources(focus_mm)
            metrics = focus_metrics(sources, self.air, np.array(focus_mm))
            with progress_bar(f"planes through {name}") as progress:
                picture = take_picture(
                    name,
                    sources,
                    self.air,
                    metrics,
                    width_mm=options.width_mm,
                    step_mm=options.step_mm,
                    progress=progress,
                )
            pictures.append(picture)
            left = energy_left(self.units, self.believed, focus_mm, self.air)
            described.append(
                {
                    "name": name,
                    **asdict(metrics),
                    "energy_left": left,
                    "modulated_force_mn": _modulated_force_mn(metrics.disc_force_mn),
                    "warnings": _warnings(metrics),
                }
            )
        notes = sorted({warning for focus in described for warning in focus["warnings"]})
        draw_foci(pictures, self._title(), notes, options.out / "field")
        return described

    def draw_budget(self, focus_mm: Triple, options: argparse.Namespace) -> list[dict[str, Any]]:
        import numpy as np

        from autd_trials.calibration.budget_figure import draw_error_budget
        from autd_trials.calibration.pose_error import error_budget

        generator = np.random.default_rng(options.seed)
        with progress_bar("error budget") as progress:
            costs = error_budget(
                self.believed,
                focus_mm,
                self.air,
                generator,
                draws=options.error_budget,
                progress=progress,
            )
        place = ", ".join(f"{x:g}" for x in focus_mm)
        title = f"Energy left at ({place}) mm, {options.error_budget} random directions per size (simulated)"
        draw_error_budget(costs, title, options.out / "error_budget")
        return [asdict(cost) for cost in costs]

    def draw_scan(self, scan: "Scan", focus_mm: Triple, options: argparse.Namespace) -> dict[str, Any]:
        import numpy as np

        from autd_trials.acoustics.field import pressure
        from autd_trials.acoustics.field_figure import draw_scan
        from autd_trials.acoustics.scan import compare_scan
        from autd_trials.acoustics.sources import Medium

        sources, medium = self.sources(focus_mm), Medium.of(self.air)
        found = compare_scan(scan, sources, medium)
        predicted_pa = np.abs(pressure(sources, medium, scan.points_mm)) / 2**0.5
        draw_scan(scan, predicted_pa, found, options.out / "scan")
        return asdict(found)

    def write_scan(self, focus_mm: Triple, options: argparse.Namespace) -> dict[str, Any]:
        import numpy as np

        from autd_trials.acoustics.grid import box_grid
        from autd_trials.acoustics.scan import write_scan
        from autd_trials.acoustics.sources import Medium

        grid = box_grid(
            np.array(focus_mm), np.eye(3)[[0, 2]], width_mm=options.width_mm, step_mm=options.step_mm
        )
        with progress_bar("scan") as progress:
            points = write_scan(options.scan, grid, self.sources(focus_mm), Medium.of(self.air), progress)
        return {"file": str(options.scan), "points": points}

    def _title(self) -> str:
        made_up = " (made up)" if self.rig.calibration.made_up else ""
        errors = "".join(
            f", unit {number} off by ({', '.join(f'{x:g}' for x in values[:3])}) mm"
            + (f" and ({', '.join(f'{x:g}' for x in values[3:])}) degrees" if values[3:] else "")
            for number, values in self.pose_errors
        )
        return f"Rig {self.rig.rig.name}{made_up}, drive {self.drive:g}{errors}: predicted, not measured"


def _named_foci(given: Sequence[Triple] | None) -> dict[str, Triple]:
    if not given:
        return PAPER_FOCI
    return {f"focus {number}": focus for number, focus in enumerate(given, start=1)}


def _moved(units: "list[UnitPose]", errors: Sequence[tuple[int, tuple[float, ...]]]) -> "list[UnitPose]":
    import numpy as np

    from autd_trials.array.geometry import moved

    if not errors:
        return units
    standing = list(units)
    for number, values in errors:
        if not 1 <= number <= len(units):
            raise UsageError(f"--pose-error names unit {number}", do=f"there are units 1 to {len(units)}")
        shift, turn = np.array(values[:3]), np.array(values[3:] or (0, 0, 0))
        standing[number - 1] = moved(standing[number - 1], shift, turn)
    return standing


def _modulated_force_mn(full_drive_mn: float) -> dict[str, dict[str, float]]:
    """Return mean, fundamental and second harmonic of the force of a sine of full depth, by force law."""
    import numpy as np

    from autd_trials.acoustics.level import force_harmonics
    from autd_trials.array.driver import Stimulus
    from autd_trials.array.envelope import amplitude
    from autd_trials.stimulus import ForceLaw

    laws: tuple[ForceLaw, ...] = ("amplitude", "pressure")
    forces: dict[str, dict[str, float]] = {}
    for law in laws:
        period = Stimulus(target_mm=(0, 0, 0), duration_s=1.0, modulation_hz=1.0, force_law=law, ramp_s=0.0)
        harmonics = force_harmonics(amplitude(period, np.arange(1000) / 1000))
        names = ("mean", "fundamental", "second_harmonic")
        forces[law] = {name: full_drive_mn * part for name, part in zip(names, harmonics, strict=True)}
    return forces


def _warnings(metrics: "FocusMetrics") -> list[str]:
    if not metrics.linear_is_upper_bound:
        return []
    return [
        "Linear theory is an upper bound here: at these pressures a plane wave is a shock within "
        "less than the focus' length, so real air saturates."
    ]


def _print(report: dict[str, Any], options: argparse.Namespace) -> int:
    if options.json:
        print_json(report)
    else:
        print_text("\n".join(_line(focus) for focus in report["foci"]))
        if "measured" in report:
            print_text(f"measured: {report['measured']}")
    for warning in sorted({w for focus in report["foci"] for w in focus["warnings"]}):
        say(f"warning: {warning}")
    say(f"pictures and field.json: {options.out}")
    return 0


def _line(focus: dict[str, Any]) -> str:
    diameters = ", ".join(f"{plane} {mm:.1f}" for plane, mm in focus["diameters_mm"].items())
    maximum = ", ".join(f"{x:.1f}" for x in focus["maximum_mm"])
    return (
        f"{focus['name']}: maximum at ({maximum}) mm, {focus['shift_mm']:.1f} mm from the focus; "
        f"{focus['energy_density_focus_j_m3']:.0f} J/m3 at the focus, {focus['energy_left']:.0%} of what "
        f"right poses give; {diameters} mm across, {focus['depth_mm']:.1f} mm deep{_lobes_line(focus)}; "
        f"{focus['disc_force_mn']:.1f} mN on a 13 mm disc"
    )


def _lobes_line(focus: dict[str, Any]) -> str:
    """Tell of the side lobes that would look like part of the focus."""
    lobes = [lobe for plane in focus["side_lobes"].values() for lobe in plane]
    if not lobes:
        return ""
    strongest = max(lobes, key=lambda lobe: float(lobe["level_db"]))
    return (
        f" (beside it side lobes of up to {strongest['level_db']:+.1f} dB, the strongest "
        f"{strongest['distance_mm']:.1f} mm away)"
    )


def _pose_error(text: str) -> tuple[int, tuple[float, ...]]:
    unit, _, values = text.partition(":")
    if not unit.isdigit():
        raise argparse.ArgumentTypeError(f"{text!r} does not begin with a unit's number, as in 2:0,0,20")
    return int(unit), numbers(values, _PARTS_OF_AN_ERROR)
