"""The report's page: one file that needs nothing else, on a screen and on paper."""

from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files

from autd_analysis.report.elements import Element, inline_svg, page_text, tag, wide
from autd_analysis.report.figures import SavedFigure
from autd_analysis.report.manuscript import methods_text, results_text
from autd_analysis.report.provenance import command, input_hashes, recorded_facts, software_versions
from autd_analysis.report.result_tables import table_section
from autd_analysis.report.summary import plain_words
from autd_analysis.results import Results

_SIMULATED = "SIMULATED PARTICIPANTS: these are no data about people."
_ABOUT_TABLES = (
    "Rounded to four digits; the TSV files beside this report have all of them. n/a: missing or undefined."
)


def report_page(results: Results, figures: Sequence[SavedFigure]) -> str:
    """Return the report of a study as an HTML page.

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
    title = f"{results.trials.design.protocol}: results"
    sections = (
        ("Summary", "summary", [tag("pre", plain_words(results))]),
        ("Remarks on the data", "remarks", [_list(results.remarks, "None.")]),
        ("Figures", "figures", [_figure(number, each) for number, each in enumerate(figures, start=1)]),
        ("Methods text", "methods", _paragraphs(methods_text(results, software_versions()))),
        ("Results text", "results", _paragraphs(results_text(results))),
        ("Tables", "tables", [tag("p", _ABOUT_TABLES), *_tables(results)]),
        ("How the numbers were found", "definitions", [_facts(_definitions(results))]),
        ("Provenance", "provenance", _provenance(results)),
    )
    page = tag(
        "html",
        tag(
            "head",
            tag("meta", charset="utf-8"),
            tag("meta", name_="viewport", content_="width=device-width, initial-scale=1"),
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
    return [tag("p", _SIMULATED, class_="simulated")] if results.trials.simulated else []


def _contents(headings: Sequence[tuple[str, str]]) -> Element:
    entries = (tag("li", tag("a", heading, href=f"#{name}")) for heading, name in headings)
    return tag("nav", tag("ul", *entries), aria_label="Contents")


def _section(heading: str, name: str, content: Sequence[Element]) -> Element:
    return tag("section", tag("h2", heading), *content, id=name)


def _list(texts: Sequence[str], or_else: str) -> Element:
    return tag("ul", *(tag("li", text) for text in texts)) if texts else tag("p", or_else)


def _paragraphs(texts: Sequence[str]) -> list[Element]:
    return [tag("p", text) for text in texts]


def _figure(number: int, saved: SavedFigure) -> Element:
    figure = saved.figure
    others = ", ".join(file.name for file in saved.files)
    return tag(
        "figure",
        tag("h3", f"Figure {number}. {figure.title}"),
        wide(inline_svg(saved.svg, figure.name, figure.about), figure.title),
        tag("figcaption", f"{figure.about} Files: {others}."),
    )


def _tables(results: Results) -> Iterator[Element]:
    """Yield the subjects' tables; of a subject without any, why, at its place."""
    for outcome in results.shown:
        yield from map(table_section, outcome.tables)
        if outcome.missing is not None:
            yield tag(
                "section",
                tag("h3", outcome.subject.title),
                tag("p", f"Not computed: {outcome.missing.cause}."),
            )


def _definitions(results: Results) -> dict[str, str]:
    return {name.replace("_", " "): text for name, text in results.definitions.items()}


def _provenance(results: Results) -> list[Element]:
    return [
        tag("h3", "How to make it again"),
        tag("pre", command(results)),
        tag("h3", "Software of this analysis"),
        _facts(software_versions()),
        *_optional("How it was recorded", recorded_facts(results)),
        tag("h3", "Inputs (SHA-256)"),
        _facts(input_hashes(results)),
    ]


def _optional(heading: str, facts: Mapping[str, str]) -> list[Element]:
    return [tag("h3", heading), _facts(facts)] if facts else []


def _facts(facts: Mapping[str, str]) -> Element:
    pairs = (each for name, fact in facts.items() for each in (tag("dt", name), tag("dd", fact)))
    return tag("dl", *pairs)
