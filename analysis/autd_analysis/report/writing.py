"""Writing the results: tables, a JSON file, figures, the report, and what makes this a BIDS derivative."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from autd_analysis.data.trials_tsv import ABOUT, trial_columns, trials_sidecar, trials_tsv
from autd_analysis.report.facets import study_facets, unwritten
from autd_analysis.report.figure_options import DEFAULT, FigureOptions
from autd_analysis.report.figures import ResultFigure, SavedFigure, save_figure_of
from autd_analysis.report.page import report_page
from autd_analysis.report.provenance import input_hashes, software_versions
from autd_analysis.report.wording import SIMULATED
from autd_analysis.results import Results
from autd_analysis.subject import Failed, failure
from autd_trials.errors import DeviceError
from autd_trials.neutral import markdown
from autd_trials.protocol.schema import Study
from autd_trials.records.disk import json_text, replace_text
from autd_trials.tables import Column, tsv

REPORT = "report.html"
_BIDS_VERSION = "1.10.0"


@dataclass(frozen=True)
class Written:
    """The files that were written, and the results, which know now what could not be drawn."""

    files: tuple[Path, ...]
    results: Results


def write_results(results: Results, folder: Path, options: FigureOptions = DEFAULT) -> Written:
    """Write everything that the analysis of a study gives.

    Parameters
    ----------
    results
        The study's results.
    folder
        Where to, ``derivatives/analysis`` of the study; made if it is not there. Files of the same names are
        replaced, others are left alone.
    options
        How figures are made.

    Returns
    -------
    Written
        The same results give the same bytes.

    Raises
    ------
    DeviceError
        The disk refuses.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        figures, results = _save_figures(results, folder, options)
        texts = {
            **{f"{table.name}.tsv": tsv(table.columns, table.rows) for table in results.tables},
            "trials.tsv": trials_tsv(results.trials),
            "trials.json": json_text(trials_sidecar(results.trials)),
            "results.json": json_text(results_json(results)),
            "README.md": markdown(_readme(results)),
            REPORT: report_page(results, figures),
            **_data_set_files(results),
            **{Failed.file_name(name): failed.traceback for name, failed in results.failures.items()},
        }
        for name, text in texts.items():
            replace_text(folder / name, text)
        _remove_old_tracebacks(results, folder)
    except OSError as error:
        raise DeviceError(
            f"disk: cannot write the results: {error.strerror or error}",
            where=str(folder),
            do="make room or give a folder that can be written to",
        ) from error
    drawn = (file for figure in figures for file in figure.files)
    return Written((*(folder / name for name in texts), *drawn), results)


def results_json(results: Results) -> dict[str, Any]:
    """Return all results of a study as one JSON object: methods, warnings, inputs and the tables' rows.

    Parameters
    ----------
    results
        The study's results.

    Returns
    -------
    dict
        Only what JSON has; what is missing or undefined is null.
    """
    trials = results.trials
    used = trials.table["used"]
    return {
        "protocol": trials.design.protocol,
        "simulated": trials.simulated,
        "participants": len(trials.participants),
        "sessions": trials.sessions,
        "trials": int(used.sum()),
        "attempts_not_counted": int((~used).sum()),
        "warnings": list(results.remarks),
        "failed": {name: failed.cause for name, failed in results.failures.items()},
        "methods": results.definitions,
        **{
            declared.name: next(
                (list(made.rows) for made in outcome.tables if made.name == declared.name), None
            )
            for outcome in results.shown
            for declared in outcome.subject.tables
        },
        "inputs": input_hashes(results),
        "software": software_versions(),
    }


def _dataset_description(results: Results, study: Study) -> dict[str, Any]:
    mark = " (simulated)" if results.trials.simulated else ""
    return {
        "Name": f"{results.trials.design.protocol}: analysis{mark}",
        "BIDSVersion": _BIDS_VERSION,
        "HEDVersion": "8.3.0",
        "DatasetType": "derivative",
        "License": study.license,
        "Authors": list(study.authors),
        "GeneratedBy": [
            {
                "Name": "autd-trials",
                "Version": version("autd-trials"),
                "Description": "Rates and planned comparisons, made from the trial tables.",
            }
        ],
        "SourceDatasets": [{"URL": "bids:raw:"}],
        "DatasetLinks": {"raw": "../.."},
    }


def _data_set_files(results: Results) -> dict[str, str]:
    """Return what makes the folder a BIDS derivative; nothing of a table of whoever recorded it."""
    study = results.trials.design.study
    if study is None:
        return {}
    return {
        "dataset_description.json": json_text(_dataset_description(results, study)),
        ".bidsignore": "*.tsv\n*.json\n*.txt\n*.png\n*.svg\n*.pdf\n*.tiff\n*.html\n",
    }


def _save_figures(
    results: Results, folder: Path, options: FigureOptions
) -> tuple[list[SavedFigure], Results]:
    """Draw all figures; return them, and the results with what could not be drawn."""
    not_drawn: dict[str, Failed] = {}
    figures: dict[str, tuple[str, ResultFigure]] = {}
    for outcome in results.shown:
        name = outcome.subject.name
        with _errors_told(name, not_drawn):
            if outcome.missing is None:
                declared = outcome.subject.figures(outcome.found, results)
                # One takes the place of an earlier one of its name, and its place in the order.
                figures |= {figure.name: (name, figure) for figure in declared}
    saved = []
    design = results.trials.design
    text = study_facets(design, options).text
    for name, figure in figures.values():
        with _errors_told(name, not_drawn):
            saved.append(save_figure_of(figure, folder, options, text))
    return saved, replace(results, not_drawn=not_drawn, of_figures=unwritten(design, options))


@contextmanager
def _errors_told(subject: str, failures: dict[str, Failed]) -> Iterator[None]:
    """Note an error of ours in a subject's figure, which stops no other; a disk that refuses is none."""
    try:
        yield
    except OSError:
        raise
    except Exception as error:
        failures[subject] = failure(subject, error, "its figures")


def _remove_old_tracebacks(results: Results, folder: Path) -> None:
    """Remove the tracebacks of an earlier run whose errors are gone."""
    for outcome in results.outcomes:
        if outcome.subject.name not in results.failures:
            (folder / Failed.file_name(outcome.subject.name)).unlink(missing_ok=True)


def _readme(results: Results) -> str:
    """Return what a person who opens the folder should read first."""
    origin = f"{SIMULATED}.\n\n" if results.trials.simulated else ""
    warnings = "".join(f"- {warning}\n" for warning in results.remarks) or "None.\n"
    methods = "".join(f"- {method}\n" for method in results.definitions.values())
    all_tables: list[tuple[str, str, Sequence[Column[Any]]]] = [
        ("trials", ABOUT, trial_columns(results.trials)),
        *((table.name, table.about, table.columns) for table in results.tables),
    ]
    described = "".join(
        f"### {name}.tsv\n\n{about}\n\n"
        + "".join(f"- `{column.name}`: {column.description}\n" for column in columns)
        + "\n"
        for name, about, columns in all_tables
    )
    return (
        f"{origin}# {results.trials.design.protocol}: results\n\n"
        "Made from the study's trial tables by `autd-trials analyse`; everything here can be made again.\n"
        f"Everything in one file, to read or print: `{REPORT}`. The figures are beside it; all "
        "numbers are in `results.json`.\n\n"
        f"## Methods\n\n{methods}\n"
        f"## Remarks on the data\n\n{warnings}\n"
        "## Tables\n\nMissing or undefined is `n/a`. Files that are not named here are of another run.\n\n"
        f"{described}"
    ).rstrip("\n") + "\n"
