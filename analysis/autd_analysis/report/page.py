"""The report's page: one file that needs nothing else, on a screen and on paper."""

import re
from collections.abc import Mapping, Sequence
from importlib.resources import files

from autd_analysis.all_figures import SavedFigure
from autd_analysis.methods import METHODS
from autd_analysis.report.answers import RULE, answers
from autd_analysis.report.elements import Element, inline_svg, page_text, tag
from autd_analysis.report.manuscript import methods_text, results_text
from autd_analysis.report.provenance import command, input_hashes, recorded_facts, software_versions
from autd_analysis.report.result_tables import table_section
from autd_analysis.study import Results
from autd_analysis.tables.table import ResultTable
from autd_analysis.wording import isolated, size_words

_SIMULATED = "SIMULATED PARTICIPANTS: these are no data about people."
_FIXED = "\N{NO-BREAK SPACE}"
_EQUATION = re.compile(" ([=<>]) ")
_METHODS = {name.replace("_", " "): text for name, text in METHODS.items()}
_ABOUT_TABLES = (
    "Rounded to four digits; the TSV files beside this report have all of them. n/a: missing or undefined."
)


def report_page(
    results: Results,
    tables: Sequence[ResultTable],
    figures: Sequence[SavedFigure],
    remarks: Sequence[str],
) -> str:
    """Return the report of a study as an HTML page.

    It opens with the answer to each planned comparison beside the main figure; remarks, methods, results and
    folded tables follow.

    Parameters
    ----------
    results
        The study's results.
    tables
        All of them as tables.
    figures
        All of them as figures that were saved, at least one.
    remarks
        What to know before using the results.

    Returns
    -------
    str
        HTML without a script and without anything that is loaded. The same results give the same text.
    """
    title = f"{isolated(results.trials.design.protocol)}: results"
    main, *others = [_figure(number, each) for number, each in enumerate(figures, start=1)]
    methods = methods_text(results, software_versions())
    sections = (
        ("Answer", "answer", [_answer(results), main]),
        ("Remarks", "remarks", [_list(remarks, "None.")]),
        (
            "Methods",
            "methods",
            [each for heading, text in methods for each in (tag("h3", heading), tag("p", _unbroken(text)))],
        ),
        ("Results", "results", [*_paragraphs(results_text(results)), *others]),
        ("Tables", "tables", [tag("p", _ABOUT_TABLES), *map(table_section, tables)]),
        ("How the numbers were found", "definitions", [_folded("Every quantity", _facts(_METHODS))]),
        ("Provenance", "provenance", _provenance(results)),
    )
    page = tag(
        "html",
        tag(
            "head",
            tag("meta", charset="utf-8"),
            tag("meta", name_="viewport", content_="width=device-width, initial-scale=1"),
            tag("meta", name_="color-scheme", content_="light dark"),
            tag("title", title),
            tag("style", files("autd_analysis.report").joinpath("report.css").read_text(encoding="utf-8")),
        ),
        tag(
            "body",
            tag("header", tag("h1", title), *_banner(results)),
            _contents([(heading, name) for heading, name, _ in sections]),
            tag("main", *(_section(*each) for each in sections)),
        ),
        lang="en",
    )
    return page_text(page)


def _banner(results: Results) -> list[Element]:
    return [tag("p", _SIMULATED, class_="simulated")] if results.simulated else []


def _contents(headings: Sequence[tuple[str, str]]) -> Element:
    entries = (tag("li", tag("a", heading, href=f"#{name}")) for heading, name in headings)
    return tag("nav", tag("ul", *entries), aria_label="Contents")


def _section(heading: str, name: str, content: Sequence[Element]) -> Element:
    return tag("section", tag("h2", heading), *content, id=name)


def _list(texts: Sequence[str], or_else: str) -> Element:
    return tag("ul", *(tag("li", text) for text in texts)) if texts else tag("p", or_else)


def _paragraphs(texts: Sequence[str]) -> list[Element]:
    return [tag("p", _unbroken(text)) for text in texts]


def _answer(results: Results) -> Element:
    found = answers(results)
    sentences = (
        tag("p", tag("strong", f"{answer.where}: "), _unbroken(answer.sentence))
        if answer.where
        else tag("p", _unbroken(answer.sentence[:1].upper() + answer.sentence[1:]))
        for answer in found
    )
    tested = bool(results.comparisons or results.threshold_comparisons)
    rule = [tag("p", RULE, class_="note")] if tested else []
    return tag(
        "div",
        tag("p", f"{size_words(results.trials)}.", class_="note"),
        *sentences,
        *rule,
        class_="sentences",
    )


def _figure(number: int, saved: SavedFigure) -> Element:
    figure = saved.figure
    files = ", ".join(file.name for file in saved.files)
    caption = (
        tag("strong", f"Figure {number}. {figure.title}. "),
        _unbroken(" ".join((*figure.caption, f"Files: {files}."))),
    )
    return tag(
        "figure",
        inline_svg(saved.drawing, figure.name, figure.about),
        tag("figcaption", *caption),
    )


def _unbroken(text: str) -> str:
    """Return a text whose equations, ``p = .031``, stay in one line."""
    return _EQUATION.sub(lambda found: f"{_FIXED}{found[1]}{_FIXED}", text)


def _folded(heading: str, *content: Element) -> Element:
    return tag("details", tag("summary", heading), *content)


def _provenance(results: Results) -> list[Element]:
    return [
        tag("p", "To make it again: ", tag("code", command(results))),
        _folded(
            "Software, recording and inputs",
            tag("h3", "Software of this analysis"),
            _facts(software_versions()),
            *_optional("How it was recorded", recorded_facts(results)),
            tag("h3", "Inputs (SHA-256)"),
            _facts(input_hashes(results)),
        ),
    ]


def _optional(heading: str, facts: Mapping[str, str]) -> list[Element]:
    return [tag("h3", heading), _facts(facts)] if facts else []


def _facts(facts: Mapping[str, str]) -> Element:
    pairs = (each for name, fact in facts.items() for each in (tag("dt", name), tag("dd", fact)))
    return tag("dl", *pairs)
