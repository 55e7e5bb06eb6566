"""The report: whole, closed to whatever people write into a study, and needing nothing from outside."""

import shutil
import subprocess
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path

import pytest
from autd_analysis.comparisons import COMPARISONS
from autd_analysis.data.foreign.request import TableRequest
from autd_analysis.data.foreign.tables import read_tables
from autd_analysis.report.figure_options import FigureOptions
from autd_analysis.report.writing import write_results
from autd_analysis.results import Results
from autd_analysis.study import analyse

from autd_trials.protocol.schema import Comparison, Level
from autd_trials.testing.recorded import Answer, StudyWriter
from tests.analysis.conftest import CHEST_COUNTS, chest_answer, chest_protocol
from tests.analysis.made_up import made_up

HOSTILE = '--><script>alert("1")</script>&amp;\'$\\alpha$'
VOID = {"meta", "wbr", "br", "hr", "img", "input", "link", "area", "base", "col", "embed", "source", "track"}


@dataclass
class Page(HTMLParser):
    """What a page has, by a parser that is not ours; refuses tags that do not match."""

    text: str
    tags: Counter[str] = field(default_factory=Counter)
    attributes: list[tuple[str, str, str]] = field(default_factory=list)
    words: str = ""

    def __post_init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self._open: list[str] = []
        self.feed(self.text)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags[tag] += 1
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self._open[-1:] != ["style"]:
            self.words += data

    def values(self, name: str) -> list[str]:
        return [value for _, key, value in self.attributes if key == name]


@dataclass(frozen=True)
class Report:
    results: Results
    folder: Path
    page: Page


def with_catch_trials(answer: Answer) -> Answer:
    """Return the same answers, and one false alarm in every block."""

    def answer_all(levels: Mapping[str, Level | None], repetition: int) -> bool | None:
        return repetition == 0 if levels["modulation_hz"] is None else answer(levels, repetition)

    return answer_all


@pytest.fixture(scope="module")
def chest_report(tmp_path_factory: pytest.TempPathFactory) -> Report:
    """The report of the chest study of `CHEST_COUNTS`, with a lost session."""
    writer = StudyWriter(tmp_path_factory.mktemp("study") / "chest", chest_protocol())
    writer.protocol = chest_protocol(catch_trials=5)
    for number, counts in enumerate(CHEST_COUNTS, start=1):
        writer.add(
            f"{number:02}",
            with_catch_trials(chest_answer(counts)),
            trials=40 if number == 8 else None,
        )
    return written(analyse(writer.folder), writer.folder / "derivatives" / "analysis")


def written(results: Results, folder: Path) -> Report:
    write_results(results, folder, FigureOptions(formats=("svg",)))
    return Report(results, folder, Page((folder / "report.html").read_text(encoding="utf-8")))


def test_it_needs_nothing_from_outside_and_runs_nothing(chest_report: Report) -> None:
    page = chest_report.page
    assert not {"script", "link", "iframe", "object", "embed", "base", "image", "img"} & set(page.tags)
    assert all(value.startswith("#") for name in ("href", "src") for value in page.values(name))
    assert not [name for _, name, _ in page.attributes if name.startswith("on")]
    assert "@import" not in page.text
    assert page.text.count("url(") == page.text.count("url(#")


def test_what_is_referred_to_is_there_once(chest_report: Report) -> None:
    page = chest_report.page
    ids = Counter(page.values("id"))
    assert max(ids.values()) == 1
    referred = {value[1:] for value in page.values("href")}
    referred |= {value[5:-1] for value in page.values("clip-path")}
    assert referred <= set(ids)
    assert any(name.startswith("rates-") for name in ids)
    assert any(name.startswith("timing-") for name in ids)


def test_it_has_every_figure_table_warning_and_input(chest_report: Report) -> None:
    page, results = chest_report.page, chest_report.results
    assert page.tags["svg"] == len(list(chest_report.folder.glob("*.svg"))) == 3
    tables = results.tables
    assert page.tags["table"] == sum(bool(table.rows) for table in tables)
    for table in tables:
        assert f"{table.name}.tsv" in page.words
        assert table.about in page.words
        for column in table.columns:
            assert column.name == "simulated" or column.description in page.words
    assert results.remarks
    assert all(warning in page.words for warning in results.remarks)
    assert all(path.name in page.words for path in results.trials.inputs)
    assert results.trials.logged[0].start.protocol_sha256 in page.words
    assert "autd-trials analyse chest" in page.words


def test_it_can_be_read_by_everybody(chest_report: Report) -> None:
    page = chest_report.page
    assert ("html", "lang", "en") in page.attributes
    assert page.tags["h1"] == page.tags["title"] == 1
    assert page.tags["caption"] == page.tags["table"]
    assert page.values("role").count("img") == page.tags["svg"]
    assert all(value for tag, name, value in page.attributes if name == "aria-label")
    assert page.values("scope")
    assert "@media print" in page.text


def test_texts_for_a_manuscript_have_the_numbers(chest_report: Report) -> None:
    words = chest_report.page.words
    assert "Eight simulated participants took part in eight sessions." in words
    assert (
        "Modulation frequency (25, 50, 100\N{NARROW NO-BREAK SPACE}Hz) and clothing (inner, inner_outer)"
        in words
    )
    # Seven sessions of 60 stimuli and 10 catch trials; of the eighth a block of 30 and 5, then 4 and 1.
    assert "530 trials were analysed: 454 with a stimulus" in words
    assert "and 76 catch trials without one" in words
    assert "Three comparisons within participants were planned" in words
    at_100 = chest_report.results[COMPARISONS][2]
    assert at_100.paired_t is not None
    assert at_100.mean is not None
    assert (
        f"100\N{NARROW NO-BREAK SPACE}Hz, the detection rate was .{100 * at_100.mean:.0f} higher with inner"
        in words
    )
    assert f"t({at_100.paired_t.df}) = {at_100.paired_t.t:.2f}" in words.replace("\N{NO-BREAK SPACE}", " ")
    assert "SIMULATED PARTICIPANTS: not human data" in words


def test_a_study_of_people_is_nowhere_called_simulated(writer: StudyWriter, tmp_path: Path) -> None:
    for participant, counts in enumerate(CHEST_COUNTS[:2], start=1):
        writer.add(f"{participant:02}", chest_answer(counts), simulated=False)
    page = written(analyse(writer.folder), tmp_path).page
    assert "simulated" not in page.words.lower()
    assert "Two participants took part in two sessions." in page.words


def test_what_people_write_is_shown_and_never_run(tmp_path: Path) -> None:
    path = tmp_path / "<b>trials.csv"
    rows = [
        f'"{person}{HOSTILE}",{int(trial < felt)},"{level}",0.5'.replace('"1"', '""1""')
        for person in "ab"
        for level, felt in ((HOSTILE, 3), ("plain", 1))
        for trial in range(4)
    ]
    path.write_text("\n".join(["who,felt,what,rt", *rows]) + "\n")
    columns = {"participant": "who", "response": "felt", "what": "what", "response_time": "rt"}
    comparison = Comparison.model_construct(factor="what", first=HOSTILE, second="plain", at_each=None)
    results = analyse(read_tables([path], TableRequest(columns, comparisons=(comparison,))))
    page = written(results, tmp_path / "out").page
    assert page.tags["script"] == page.tags["b"] == 0
    assert HOSTILE in page.words
    assert f"a{HOSTILE}" in page.words


def test_the_same_results_give_the_same_page_wherever_it_is_written(
    chest_report: Report, tmp_path: Path
) -> None:
    again = written(analyse(chest_report.folder.parent.parent), tmp_path)
    assert again.page.text == chest_report.page.text
    assert str(chest_report.folder.parent.parent.parent) not in again.page.text


def test_a_browser_reads_it_as_it_was_meant(chest_report: Report, tmp_path: Path) -> None:
    browser = shutil.which("chromium")
    if browser is None:
        pytest.skip("chromium is not installed")
    report = chest_report.folder / "report.html"
    quiet = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run")
    closed = ("--disable-background-networking", "--disable-component-update", "--disable-sync")
    done = subprocess.run(
        [browser, *quiet, *closed, f"--user-data-dir={tmp_path}", "--dump-dom", report.as_uri()],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    seen = Page(done.stdout)
    for name in ("svg", "use", "path", "table", "tr", "td", "th", "section", "dt", "dd", "p"):
        assert seen.tags[name] == chest_report.page.tags[name], name
    assert seen.words.split() == chest_report.page.words.split()


def test_it_opens_with_the_answers_beside_the_main_figure(chest_report: Report) -> None:
    text = chest_report.page.text
    places = [text.index(f'id="{name}"') for name in ("answer", "remarks", "methods", "results", "tables")]
    assert places == sorted(places)
    opening = text[places[0] : places[1]]
    assert opening.count("<svg") == 1
    found = [answer for view in chest_report.results.views for answer in view.answers]
    assert len(found) == 3
    for answer in found:
        assert answer.where in opening
        assert answer.sentence.split(":")[0] in opening


def test_every_figure_has_one_caption_and_no_words_of_its_own_below(chest_report: Report) -> None:
    page = chest_report.page
    assert page.tags["figcaption"] == page.tags["figure"] == page.tags["svg"]
    assert page.words.count("thin lines join the same one") == 2  # of rates and of timing
    assert page.tags["pre"] == 0


def test_tables_are_folded_and_shown_on_paper(chest_report: Report) -> None:
    page = chest_report.page
    tables = [table for table in chest_report.results.tables if table.rows]
    assert page.tags["details"] >= 2 * len(tables)
    assert "open" not in {name for tag, name, _ in page.attributes if tag == "details"}
    assert "details::details-content" in page.text
    assert "prefers-color-scheme: dark" in page.text


def test_methods_come_from_the_log(chest_report: Report) -> None:
    words = chest_report.page.words.replace("\N{NARROW NO-BREAK SPACE}", " ")
    for said in (
        "from 9 emulated AUTD3 devices (2241 transducers)",
        "A stimulus was a focus for 1 s",
        "modulated by a sine of 25, 50 or 100 Hz, depth 1",
        "A press within 2.5 s of the onset counted as felt",
        "a pause of 1.5\N{EN DASH}2.5 s",
        "No sound masked that of the array.",
        "Foci, in mm in the frame of unit 1",
    ):
        assert said in words


def test_names_from_right_to_left_are_isolated(tmp_path: Path) -> None:
    study = made_up(tmp_path, {"الملابس": ("قطن 25", "صوف 100")}, compared="الملابس", people=3)
    page = written(study, tmp_path / "out").page
    assert "\u2068قطن 25\u2069" in page.words
