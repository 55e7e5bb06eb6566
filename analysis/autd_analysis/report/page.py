"""The report's page: one file that needs nothing else, on a screen and on paper."""

import re
from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files

from autd_analysis.report.answers import RULE
from autd_analysis.report.elements import Element, inline_svg, page_text, tag
from autd_analysis.report.figures import SavedFigure
from autd_analysis.report.manuscript import methods_text, results_text
from autd_analysis.report.provenance import command, input_hashes, recorded_facts, software_versions
from autd_analysis.report.result_tables import table_section
from autd_analysis.report.wording import SIMULATED, isolated, size_words, upper_first
from autd_analysis.results import Results

_FIXED = "\N{NO-BREAK SPACE}"
_EQUATION = re.compile(" ([=<>]) ")
_ABOUT_TABLES = (
    "Rounded to four digits; the TSV files beside this report have all of them. n/a: missing or undefined."
)


def report_page(results: Results, figures: Sequence[SavedFigure]) -> str:
    """Return the report of a study as an HTML page.

    It opens with the answer to each planned comparison beside the first figure; remarks, methods, results and
    folded tables follow.

    Parameters
    ----------
    results
        The study's results.
    figures
        Its figures as they were saved.

    Returns
    -------
    str
        HTML without a script and without anything that is loaded. The same results give the same text.
    """
    title = f"{isolated(results.trials.design.protocol)}: results"
    drawn = [_figure(number, each) for number, each in enumerate(figures, start=1)]
    methods = methods_text(results, software_versions())
    sections = (
        ("Answer", "answer", [_answer(results), *drawn[:1]]),
        ("Remarks", "remarks", [_list(results.remarks, "None.")]),
        ("Methods", "methods", [each for part in methods for each in _method(*part)]),
        ("Results", "results", [*_paragraphs(results_text(results)), *drawn[1:]]),
        ("Tables", "tables", [tag("p", _ABOUT_TABLES), *_tables(results)]),
        (
            "How the numbers were found",
            "definitions",
            [_folded("Every quantity", _facts(_definitions(results)))],
        ),
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
    return [tag("p", SIMULATED, class_="simulated")] if results.trials.simulated else []


def _contents(headings: Sequence[tuple[str, str]]) -> Element:
    entries = (tag("li", tag("a", heading, href=f"#{name}")) for heading, name in headings)
    return tag("nav", tag("ul", *entries), aria_label="Contents")


def _section(heading: str, name: str, content: Sequence[Element]) -> Element:
    return tag("section", tag("h2", heading), *content, id=name)


def _list(texts: Sequence[str], or_else: str) -> Element:
    return tag("ul", *(tag("li", text) for text in texts)) if texts else tag("p", or_else)


def _paragraphs(texts: Sequence[str]) -> list[Element]:
    return [tag("p", _unbroken(text)) for text in texts]


def _method(heading: str, text: str) -> tuple[Element, Element]:
    return tag("h3", heading), tag("p", _unbroken(text))


def _answer(results: Results) -> Element:
    found = [answer for view in results.views for answer in view.answers]
    sentences = (
        tag("p", tag("strong", f"{answer.where}: "), _unbroken(answer.sentence))
        if answer.where
        else tag("p", _unbroken(upper_first(answer.sentence)))
        for answer in found
    )
    rule = [tag("p", RULE, class_="note")] if results.trials.design.comparisons and found else []
    size = tag("p", f"{size_words(results.trials)}.", class_="note")
    return tag("div", size, *sentences, *rule, class_="sentences")


def _figure(number: int, saved: SavedFigure) -> Element:
    figure = saved.figure
    files_ = ", ".join(file.name for file in saved.files)
    caption = _unbroken(" ".join((*figure.caption, f"Files: {files_}.")))
    return tag(
        "figure",
        inline_svg(saved.drawing, figure.name, figure.about),
        tag("figcaption", tag("strong", f"Figure {number}. {figure.title}. "), caption),
    )


def _folded(heading: str, *content: Element) -> Element:
    return tag("details", tag("summary", heading), *content)


def _unbroken(text: str) -> str:
    """Return a text whose equations, ``p = .031``, stay in one line."""
    return _EQUATION.sub(lambda found: f"{_FIXED}{found[1]}{_FIXED}", text)


def _tables(results: Results) -> Iterator[Element]:
    """Yield the subjects' tables; of a subject without any, why, at its place."""
    for outcome in results.shown:
        yield from map(table_section, outcome.tables)
        if outcome.missing is not None:
            yield tag("p", f"{outcome.subject.title}. Not computed: {outcome.missing.cause}.")


def _definitions(results: Results) -> dict[str, str]:
    return {name.replace("_", " "): text for name, text in results.definitions.items()}


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
