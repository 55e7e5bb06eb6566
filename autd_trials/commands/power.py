"""`autd-trials power`: how many participants a study needs."""

import argparse
import re
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from autd_trials.commands.output import print_json, print_text, say
from autd_trials.commands.progress import progress_bar
from autd_trials.errors import DeviceError, UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from autd_analysis.power.model import StudyModel
    from autd_analysis.power.run import PowerRow

_TESTS = ("sign_flip", "paired_t", "mixed_model")
_FEWEST, _MOST = 3, 200
_COMMON_SD, _CELL_SD = 1.0, 0.57
_LARGEST_SD = 20.0
_ENOUGH = 0.8
"""The power that studies are usually planned for."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("protocol", metavar="PROTOCOL", help="path, or the bare name of a shipped protocol")
    parser.add_argument(
        "--participants", type=_sizes, default=(4, 6, 8, 12, 16), metavar="A-B", help="8, 4-24 or 6,8,12"
    )
    parser.add_argument("--studies", type=int, default=2000, metavar="N", help="of each size (2000)")
    parser.add_argument(
        "--tests",
        type=_tests,
        default=("sign_flip", "paired_t"),
        metavar="T,...",
        help="of sign_flip, paired_t, mixed_model (the first two; the last takes 50 ms a study)",
    )
    parser.add_argument("--alpha", type=float, default=0.05, metavar="P", help="level of significance (0.05)")
    parser.add_argument(
        "--rates", type=Path, metavar="CSV", help="rates of an average person: a column a factor, and rate"
    )
    parser.add_argument(
        "--common-sd",
        type=float,
        metavar="SD",
        help="with --rates: people's logits differ (1.0)",
    )
    parser.add_argument(
        "--cell-sd", type=float, metavar="SD", help="with --rates: and in each condition (0.57)"
    )
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of everything (1)")
    parser.add_argument("--jobs", type=int, default=-1, metavar="N", help="processes (all cores)")
    parser.add_argument("--dask", metavar="ADDRESS", help="a Dask scheduler that shares the work out instead")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="write power.tsv and the figure there (PNG, SVG, PDF)"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def execute(options: argparse.Namespace) -> int:
    """Simulate studies and say how often they find what they look for."""
    from autd_analysis.power.run import Question, power_analysis

    _refuse_nonsense(options)
    model = _model(options)
    question = Question(options.participants, options.studies, options.tests, options.alpha, options.seed)
    with _workers(options.dask), progress_bar("studies") as progress:
        rows = power_analysis(model, question, jobs=options.jobs, progress=progress)
    facts = {
        "protocol": options.protocol,
        "population": _population(options),
        "alpha": options.alpha,
        "seed": options.seed,
        "rows": _plain(rows),
    }
    if options.out is not None:
        _write(rows, options, facts["population"])
    if options.json:
        print_json(facts)
    else:
        print_text(_text(rows, options))
    return 0


def _refuse_nonsense(options: argparse.Namespace) -> None:
    if options.studies < 1:
        raise UsageError(f"--studies is {options.studies}", do="simulate at least 1; 2000 tell power to 2 %")
    if not 0 < options.alpha < 1:
        raise UsageError(f"--alpha is {options.alpha:g}", do="give a level over 0 and under 1")
    given = [sd for sd in (options.common_sd, options.cell_sd) if sd is not None]
    if given and options.rates is None:
        raise UsageError(
            "--common-sd and --cell-sd go with --rates; the assumed participants differ as their model says",
            do="leave them out, or give --rates",
        )
    if not all(0 <= sd <= _LARGEST_SD for sd in given):
        raise UsageError("a standard deviation is no number of logits", do=f"give 0 to {_LARGEST_SD:g}")
    if options.seed < 0:
        raise UsageError(f"--seed is {options.seed}", do="give 0 or more")
    if options.jobs == 0:
        raise UsageError("--jobs is 0", do="give a number of processes, or -1 for all cores")


def _model(options: argparse.Namespace) -> "StudyModel":
    from autd_analysis.data.design import protocol_design
    from autd_analysis.power.model import read_rates, study_model

    from autd_trials.protocol.load import find_protocol, load_protocol_with_sha256

    protocol = load_protocol_with_sha256(find_protocol(options.protocol))[0]
    rates = None if options.rates is None else read_rates(options.rates, protocol_design(protocol))
    return study_model(protocol, rates, _sds(options))


def _sds(options: argparse.Namespace) -> tuple[float, float]:
    common = _COMMON_SD if options.common_sd is None else options.common_sd
    return common, _CELL_SD if options.cell_sd is None else options.cell_sd


def _population(options: argparse.Namespace) -> str:
    if options.rates is None:
        return "simulated participants (an assumed model, no data)"
    common, cell = _sds(options)
    return f"rates of {options.rates}, people differ by {common:g} and {cell:g} logits"


@contextmanager
def _workers(address: str | None) -> "Iterator[None]":
    """Let joblib hand the work to a Dask cluster while the context lasts, if there is an address."""
    if address is None:
        yield
        return
    import joblib

    try:
        from distributed import Client
    except ImportError as error:
        raise UsageError("Dask is not installed", do="pip install 'autd-trials[cluster]'") from error
    try:
        client = Client(address, timeout="10s")  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TimeoutError) as error:
        raise DeviceError(f"no Dask scheduler answers: {error}", where=address) from error
    with client, joblib.parallel_config(backend="dask"):
        yield


def _plain(rows: "Sequence[PowerRow]") -> list[dict[str, Any]]:
    return [asdict(row) for row in rows]


def _write(rows: "Sequence[PowerRow]", options: argparse.Namespace, population: str) -> None:
    from autd_analysis.power.figure import draw_power
    from autd_analysis.power.table import power_tsv

    table = power_tsv(rows, alpha=options.alpha, seed=options.seed, population=population)
    try:
        options.out.mkdir(parents=True, exist_ok=True)
        draw_power(rows, options.alpha, Path(options.protocol).stem, population, options.out)
        (options.out / "power.tsv").write_text(table, encoding="utf-8")
    except OSError as error:
        raise DeviceError(
            f"disk: cannot write the results: {error.strerror or error}",
            where=str(options.out),
            do="make room or give a folder that can be written to",
        ) from error
    say(f"table and figure: {options.out}")


def _text(rows: "Sequence[PowerRow]", options: argparse.Namespace) -> str:
    lines = [
        f"{_population(options)}; {rows[0].studies} studies of each size, seed {options.seed}",
        f"share that finds the difference at p <= {options.alpha:g}, with its 95 % Monte Carlo interval;",
        "that with Holm's adjustment; that in studies without a difference; mean width of the interval:",
    ]
    for row in rows:
        interval = (
            f"[{row.power_interval.low:.3f}, {row.power_interval.high:.3f}]" if row.power_interval else ""
        )
        width = "no interval" if row.interval_width is None else f"interval {row.interval_width:.2f} wide"
        lines.append(
            f"  n = {row.participants:<3} {row.comparison}, {row.test}: {row.power:.3f} {interval}, "
            f"Holm {row.power_holm:.3f}; without a difference {row.false_positives:.3f}; "
            f"{width} ({row.interval})"
        )
    return "\n".join([*lines, *_enough(rows)])


def _enough(rows: "Sequence[PowerRow]") -> "Iterator[str]":
    """Yield from which size on each comparison is found often enough, after Holm's adjustment."""
    yield f"smallest size of those simulated with a power of {_ENOUGH:g} after Holm's adjustment:"
    for comparison, test in dict.fromkeys((row.comparison, row.test) for row in rows):
        sizes = [
            row.participants
            for row in rows
            if (row.comparison, row.test) == (comparison, test) and row.power_holm >= _ENOUGH
        ]
        yield f"  {comparison}, {test}: {min(sizes) if sizes else 'none'}"


def _sizes(text: str) -> tuple[int, ...]:
    if match := re.fullmatch(r"(\d+)-(\d+)", text):
        sizes = tuple(range(int(match[1]), int(match[2]) + 1))
    elif re.fullmatch(r"\d+(,\d+)*", text):
        sizes = tuple(int(part) for part in text.split(","))
    else:
        sizes = ()
    if not sizes or min(sizes) < _FEWEST or max(sizes) > _MOST or len(set(sizes)) < len(sizes):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not sizes of {_FEWEST} to {_MOST} participants, as in 8, 4-24 or 6,8,12"
        )
    return sizes


def _tests(text: str) -> tuple[str, ...]:
    tests = tuple(text.split(","))
    if not set(tests) <= set(_TESTS) or len(set(tests)) < len(tests):
        raise argparse.ArgumentTypeError(f"{text!r} is not some of {', '.join(_TESTS)}")
    return tests
