"""Writing the results: tables, a JSON file, figures, the report, and what makes this a BIDS derivative."""

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from autd_analysis.all_figures import save_figures
from autd_analysis.methods import METHODS
from autd_analysis.report.facets import unwritten
from autd_analysis.report.figure_options import DEFAULT, FigureOptions
from autd_analysis.report.page import report_page
from autd_analysis.report.provenance import input_hashes, software_versions
from autd_analysis.study import Results
from autd_analysis.tables.all_tables import result_tables
from autd_analysis.tables.table import ResultTable
from autd_trials.errors import DeviceError
from autd_trials.protocol.schema import Study
from autd_trials.records.disk import json_text, replace_text
from autd_trials.tables import tsv

REPORT = "report.html"
_BIDS_VERSION = "1.10.0"


def write_results(results: Results, folder: Path, options: FigureOptions = DEFAULT) -> list[Path]:
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
    list of Path
        The files written. The same results give the same bytes.

    Raises
    ------
    DeviceError
        The disk refuses.
    """
    tables = result_tables(results)
    remarks = all_remarks(results, options)
    texts = {f"{table.name}.tsv": tsv(table.columns, table.rows) for table in tables} | {
        "results.json": json_text(results_json(results)),
        "README.md": _readme(results, tables, remarks),
    }
    if results.trials.design.study is not None:
        texts["dataset_description.json"] = json_text(
            _dataset_description(results, results.trials.design.study)
        )
        texts[".bidsignore"] = "*.tsv\n*.json\n*.png\n*.svg\n*.pdf\n*.tiff\n*.html\n"
    try:
        for name, text in texts.items():
            replace_text(folder / name, text)
        figures = save_figures(results, folder, options)
        replace_text(folder / REPORT, report_page(results, tables, figures, remarks))
    except OSError as error:
        raise DeviceError(
            f"disk: cannot write the results: {error.strerror or error}",
            where=str(folder),
            do="make room or give a folder that can be written to",
        ) from error
    return [
        *(folder / name for name in (*texts, REPORT)),
        *(file for figure in figures for file in figure.files),
    ]


def all_remarks(results: Results, options: FigureOptions = DEFAULT) -> tuple[str, ...]:
    """Return what to know before using results and figures.

    Parameters
    ----------
    results
        The study's results.
    options
        How figures are made.
    """
    return (*results.warnings, *unwritten(results.trials.design, options))


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
        "simulated": results.simulated,
        "participants": len(trials.participants),
        "sessions": trials.sessions,
        "trials": int(used.sum()),
        "attempts_not_counted": int((~used).sum()),
        "warnings": list(results.warnings),
        "methods": dict(METHODS),
        **{table.name: list(table.rows) for table in result_tables(results)},
        "inputs": input_hashes(results),
        "software": software_versions(),
    }


def _dataset_description(results: Results, study: Study) -> dict[str, Any]:
    mark = " (simulated)" if results.simulated else ""
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


def _readme(results: Results, tables: Sequence[ResultTable], remarks: Sequence[str]) -> str:
    """Return what a person who opens the folder should read first."""
    origin = "SIMULATED PARTICIPANTS: these are no data about people.\n\n" if results.simulated else ""
    warnings = "".join(f"- {remark}\n" for remark in remarks) or "None.\n"
    methods = "".join(f"- {method}\n" for method in METHODS.values())
    described = "".join(
        f"### {table.name}.tsv\n\n{table.about}\n\n"
        + "".join(f"- `{column.name}`: {column.description}\n" for column in table.columns)
        + "\n"
        for table in tables
    )
    return (
        f"{origin}# {results.trials.design.protocol}: results\n\n"
        "Made from the study's trial tables by `autd-trials analyse`; everything here can be made again.\n"
        f"Everything in one file, to read or print: `{REPORT}`. The figures are beside it; all "
        "numbers are in `results.json`.\n\n"
        f"## Methods\n\n{methods}\n"
        f"## Remarks on the data\n\n{warnings}\n"
        f"## Tables\n\nMissing or undefined is `n/a`.\n\n{described}"
    ).rstrip("\n") + "\n"
