"""`autd-trials calibrate`: where the units stand."""

import argparse
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from autd_trials.calibration.writing import refuse_existing, writing
from autd_trials.commands.arguments import moment, numbers, positive, triple
from autd_trials.commands.calibrate_acoustic import refine_by_sound
from autd_trials.commands.output import print_json, print_text, say
from autd_trials.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from autd_trials.calibration.normal_equations import Wand
    from autd_trials.calibration.provenance import Capture, Inputs
    from autd_trials.calibration.rigid import RigidMotion
    from autd_trials.calibration.settings import Settings
    from autd_trials.calibration.solve import Solution
    from autd_trials.calibration.track import Track

_FEWEST_UNITS = 2
_LARGEST_SHARE = 0.1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    _add_sources(parser)
    parser.add_argument(
        "--out", type=Path, required=True, metavar="FILE", help="the calibration file to write"
    )
    _add_provenance(parser)
    _add_sensors(parser)
    _add_method(parser)
    _add_acoustic(parser)
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of all that is random (1)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def _add_sources(parser: argparse.ArgumentParser) -> None:
    """Add what is calibrated from."""
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument(
        "--points",
        type=Path,
        nargs="+",
        metavar="CSV",
        help="one track a unit (t_s,x_mm,y_mm,z_mm), the first unit's first",
    )
    source.add_argument(
        "--pairs",
        type=Path,
        nargs="+",
        metavar="CSV",
        help="points without times, a row a point in the frames of unit 1 and another "
        "(x1_mm,y1_mm,z1_mm,x2_mm,y2_mm,z2_mm): a file for unit 2, one for unit 3, ...",
    )
    source.add_argument(
        "--live",
        type=Path,
        metavar="FOLDER",
        help="record the units' sensor nodes into a new folder while the target is waved, then calibrate",
    )
    source.add_argument(
        "--recorded", type=Path, metavar="FOLDER", help="calibrate from what --live recorded earlier"
    )
    source.add_argument(
        "--acoustic",
        metavar="CSV",
        help="refine --calibration by what a microphone heard, or simulated:TRUE.yaml to try it",
    )
    parser.add_argument(
        "--units", type=int, default=2, metavar="N", help="with --live: how many units there are (2)"
    )
    parser.add_argument(
        "--seconds", type=positive, metavar="S", help="with --live: end after so long (at Ctrl-C)"
    )


def _add_provenance(parser: argparse.ArgumentParser) -> None:
    """Add what the files do not say themselves."""
    parser.add_argument(
        "--measured-by",
        metavar="SENSOR",
        help="what measured the files that do not say so (real rigs refuse data of unknown origin)",
    )
    parser.add_argument(
        "--taken", type=moment, metavar="TIME", help="with --measured-by: when, as 2026-11-22T09:30:00Z"
    )
    parser.add_argument(
        "--names", nargs="+", metavar="NAME", help="what the units are called ('unit 1' 'unit 2' ...)"
    )
    parser.add_argument(
        "--mounts",
        metavar="FILE",
        help="how each sensor is mounted on its unit (as the unit's frame)",
    )


def _add_sensors(parser: argparse.ArgumentParser) -> None:
    """Add what is known of the sensors and their errors."""
    parser.add_argument(
        "--range-bias",
        action=argparse.BooleanOptionalAction,
        help="allow for a constant error of every sensor's range (yes; the paper's method cannot)",
    )
    parser.add_argument(
        "--range-scale-sd",
        type=_share,
        default=0.005,
        metavar="SHARE",
        help="what the sensors' scale may be wrong by, which points do not see (0.005; 0 if it was checked)",
    )
    parser.add_argument(
        "--viewpoint",
        action=argparse.BooleanOptionalAction,
        help="the points were seen from the origin of their frames, as by cameras, and err along the ray "
        "(yes; with --pairs no: robots, motion capture, SLAM)",
    )
    parser.add_argument(
        "--noise", type=_noise, default=(3.0, 1.0), metavar="ALONG,ACROSS", help="the sensors' in mm (3,1)"
    )
    parser.add_argument(
        "--wand",
        type=Path,
        nargs="+",
        metavar="CSV",
        help="a wand as each sensor saw it, to estimate range scales",
    )
    parser.add_argument("--wand-length-mm", type=positive, metavar="MM", help="from marker to marker")


def _add_method(parser: argparse.ArgumentParser) -> None:
    """Add how units are registered, and where the energy is predicted."""
    parser.add_argument(
        "--method",
        choices=("joint", "paper"),
        default="joint",
        help="joint likelihood, or the paper's (joint)",
    )
    parser.add_argument(
        "--pairing",
        choices=("interpolated", "nearest"),
        help="in time, with the clocks' offset, or nearest stamps (nearest with --method paper)",
    )
    parser.add_argument(
        "--mad-factor",
        type=positive,
        metavar="F",
        help="of the paper's equation 10, which prints 0.6475 for 0.6745 (0.6745)",
    )
    parser.add_argument(
        "--target",
        type=triple,
        metavar="X,Y,Z",
        help="where the energy is predicted, in mm (the cloud's centre)",
    )


def _add_acoustic(parser: argparse.ArgumentParser) -> None:
    """Add what goes with a microphone."""
    parser.add_argument(
        "--calibration", type=Path, metavar="FILE", help="with --acoustic: the calibration to start from"
    )
    parser.add_argument(
        "--microphone-sd-mm",
        type=positive,
        default=0.1,
        metavar="MM",
        help="with --acoustic: how well each coordinate of the microphone is known (0.1)",
    )
    parser.add_argument(
        "--air-temperature-c", type=float, default=20.0, metavar="C", help="with --acoustic: of the air (20)"
    )
    parser.add_argument(
        "--amplitude-only",
        action="store_true",
        help="with --acoustic simulated: four phase steps instead of phases",
    )


def execute(options: argparse.Namespace) -> int:
    """Calibrate and write the calibration file, with a picture beside it."""
    from autd_trials.calibration.provenance import Inputs

    refuse_existing(options.out, "calibration")
    stated = _stated(options)
    if options.acoustic:
        now = _now()
        return refine_by_sound(options, Inputs(stated, now), now)
    for suffix in (".png", ".svg"):
        refuse_existing(options.out.with_suffix(suffix), "picture")
    units = _count_units(options)
    _refuse_contradictions(options, units)
    names = options.names or [f"unit {number}" for number in range(1, units + 1)]
    if options.live:
        _record(options, names, _mounts(options.mounts, names, Inputs(None, _now())))
    now = _now()
    inputs = Inputs(stated, now)
    mounts = _mounts(options.mounts, names, inputs)
    if options.pairs:
        return _from_pairs(options, names, mounts, inputs, now)
    paths = options.points or _recorded_tracks(options.live or options.recorded, names)
    return _from_tracks(options, _tracks(paths, names, inputs), mounts, inputs, now)


def _now() -> datetime:
    return datetime.now(UTC).replace(microsecond=0)


def _stated(options: argparse.Namespace) -> "Capture | None":
    """Return what the person says of files that do not say themselves where they come from."""
    from autd_trials.calibration.provenance import MOST_LETTERS, Capture

    if (options.measured_by is None) != (options.taken is None):
        raise UsageError("--measured-by and --taken belong together", do="give both, or neither")
    if options.measured_by is None:
        return None
    if options.live:
        raise UsageError(
            "--measured-by belongs to files; a live sensor says itself what it is", do="leave it out"
        )
    if not 0 < len(options.measured_by) <= MOST_LETTERS:
        raise UsageError(
            f"--measured-by has {len(options.measured_by)} letters", do=f"give 1 to {MOST_LETTERS}"
        )
    return Capture(origin="measured", sensor=options.measured_by, taken=options.taken)


def _from_tracks(
    options: argparse.Namespace,
    tracks: "Sequence[Track]",
    mounts: "list[RigidMotion] | None",
    inputs: "Inputs",
    now: datetime,
) -> int:
    from autd_trials.acoustics.air import Air
    from autd_trials.calibration.solve import calibrate

    wands = _wands(options, inputs)
    solution = calibrate(
        tracks,
        _settings(options),
        time=now,
        air=Air(),
        mounts=mounts,
        wands=wands,
        inputs=inputs.sha256,
        sources=inputs.sources,
    )
    return _write(options, solution)


def _from_pairs(
    options: argparse.Namespace,
    names: "Sequence[str]",
    mounts: "list[RigidMotion] | None",
    inputs: "Inputs",
    now: datetime,
) -> int:
    from autd_trials.acoustics.air import Air
    from autd_trials.calibration.pairs import read_pairs, solve_pairs

    pairs = [read_pairs(path, unit) for unit, path in enumerate(options.pairs, start=2)]
    for path in options.pairs:
        inputs.add_data("pairs", path)
    solution = solve_pairs(
        pairs,
        names,
        _settings(options),
        time=now,
        air=Air(),
        mounts=mounts,
        inputs=inputs.sha256,
        sources=inputs.sources,
    )
    return _write(options, solution)


def _write(options: argparse.Namespace, solution: "Solution") -> int:
    """Write the calibration and its picture, and say what it is worth."""
    from autd_trials.calibration.file import write_calibration
    from autd_trials.calibration.report import report, report_text
    from autd_trials.calibration.report_figure import draw_calibration

    write_calibration(solution.calibration, options.out)
    with writing(options.out.parent, f"the calibration is in {options.out}; only its picture is missing"):
        pictures = draw_calibration(solution, options.out.with_suffix(""))
    facts = report(solution)
    if options.json:
        print_json({"calibration": str(options.out), **facts})
    else:
        print_text(report_text(facts))
    for warning in solution.warnings:
        say(f"warning: {warning}")
    say(f"calibration: {options.out}, picture: {pictures[0]}")
    return 0


def _count_units(options: argparse.Namespace) -> int:
    from autd_trials.calibration.network.recording import recorded_units

    if options.points:
        return len(options.points)
    if options.pairs:
        return len(options.pairs) + 1
    return int(options.units) if options.live else recorded_units(options.recorded)


def _record(options: argparse.Namespace, names: "Sequence[str]", mounts: "list[RigidMotion] | None") -> None:
    import numpy as np

    from autd_trials.calibration.report import WORKSPACE_HALF_MM
    from autd_trials.calibration.rigid import RigidMotion
    from autd_trials.commands.calibrate_live import record_live

    record_live(
        options.live,
        names,
        first_mount=mounts[0] if mounts else RigidMotion.identity(),
        centre_mm=None if options.target is None else np.array(options.target),
        half_mm=WORKSPACE_HALF_MM,
        seconds=options.seconds,
    )


def _recorded_tracks(folder: Path, names: "Sequence[str]") -> list[Path]:
    from autd_trials.calibration.network.recording import clock_jumps, silences, write_track

    paths = [write_track(folder, unit) for unit in range(1, len(names) + 1)]
    for unit, name in enumerate(names, start=1):
        for start_s, end_s in silences(folder, unit):
            say(f"warning: nothing came from {name} from {start_s:.1f} to {end_s:.1f} s of its clock")
        for start_s, end_s in clock_jumps(folder, unit):
            say(
                f"warning: the clock of {name} jumped between {start_s:.1f} and {end_s:.1f} s; what it saw "
                "meanwhile is left out"
            )
    return paths


def _refuse_contradictions(options: argparse.Namespace, units: int) -> None:
    if units < _FEWEST_UNITS:
        raise UsageError(f"this is {units} unit", do="calibrate two units or more, one track each")
    if options.seconds is not None and options.live is None:
        raise UsageError("--seconds belongs to --live", do="leave it out")
    if (options.wand is None) != (options.wand_length_mm is None):
        raise UsageError("--wand and --wand-length-mm belong together", do="give both, or neither")
    if options.wand is not None and len(options.wand) != units:
        raise UsageError(
            f"--wand names {len(options.wand)} files for {units} units", do="give one for each unit"
        )
    if options.names is not None and len(options.names) != units:
        raise UsageError(
            f"--names gives {len(options.names)} names for {units} units", do="give one for each unit"
        )
    if options.pairs and (options.pairing or options.wand):
        raise UsageError("points without times are paired already", do="leave out --pairing and --wand")
    _refuse_names(options.names or ())
    if options.method == "paper" and (options.range_bias or options.wand):
        raise UsageError(
            "the paper's method knows no errors of the range", do="leave out --range-bias and --wand"
        )
    if options.method != "paper" and options.mad_factor is not None:
        raise UsageError("--mad-factor belongs to the paper's method", do="add --method paper")


def _refuse_names(names: "Sequence[str]") -> None:
    from autd_trials.calibration.file import MOST_LETTERS

    for name in names:
        if not name.strip() or len(name) > MOST_LETTERS or not name.isprintable():
            raise UsageError(
                f"--names gives {name[:20]!r}{'...' if len(name) > 20 else ''} ({len(name)} letters)",
                do=f"give each unit a name of 1 to {MOST_LETTERS} printable letters",
            )
    if len(set(names)) < len(names):
        raise UsageError(f"--names gives {', '.join(names)}", do="give each unit a name of its own")


def _settings(options: argparse.Namespace) -> "Settings":
    from autd_trials.calibration.robust import NORMAL_MAD_FACTOR
    from autd_trials.calibration.sensor_model import SensorNoise
    from autd_trials.calibration.settings import Settings

    return Settings(
        method=options.method,
        pairing=options.pairing or ("nearest" if options.method == "paper" else "interpolated"),
        mad_factor=options.mad_factor or NORMAL_MAD_FACTOR,
        range_bias=options.method == "joint" and options.range_bias is not False,
        range_scale_sd=options.range_scale_sd,
        viewpoint=options.viewpoint,
        noise=SensorNoise(*options.noise),
        target_mm=options.target,
        seed=options.seed,
    )


def _tracks(paths: "Sequence[Path]", names: "Sequence[str]", inputs: "Inputs") -> "list[Track]":
    from autd_trials.calibration.track import read_track

    tracks = [read_track(path, name) for path, name in zip(paths, names, strict=True)]
    for path in paths:
        inputs.add_data("track", path)
    return tracks


def _mounts(name: str | None, names: "Sequence[str]", inputs: "Inputs") -> "list[RigidMotion] | None":
    from autd_trials.calibration.mounts import load_mounts
    from autd_trials.yamlfile.shipped import find_file

    if name is None:
        return None
    path = find_file(name, kind="mounts file", folder="scenes")
    mounts, digest = load_mounts(path)
    inputs.add("mounts", path, digest, mounts.capture)
    mounted = [mount.unit for mount in mounts.mounts]
    if mounted != list(names):
        raise UsageError(
            f"these are mounts of {', '.join(mounted)}; the units are {', '.join(names)}",
            where=str(path),
            do="give the same units in the same order, or name them with --names",
        )
    return [mount.motion for mount in mounts.mounts]


def _wands(options: argparse.Namespace, inputs: "Inputs") -> "list[Wand]":
    from autd_trials.calibration.track import read_wand

    paths = options.wand or []
    wands = [read_wand(path, options.wand_length_mm) for path in paths]
    for path in paths:
        inputs.add_data("wand", path)
    return wands


def _noise(text: str) -> tuple[float, ...]:
    values = numbers(text, (2,))
    if min(values) <= 0:
        raise argparse.ArgumentTypeError(f"{text!r}: both must be over 0")
    return values


def _share(text: str) -> float:
    (value,) = numbers(text, (1,))
    if not 0 <= value < _LARGEST_SHARE:
        raise argparse.ArgumentTypeError(f"{text!r}: give a share of the range, 0 to {_LARGEST_SHARE:g}")
    return value
