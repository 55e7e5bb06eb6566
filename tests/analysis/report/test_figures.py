"""Figures keep every condition and every word, apart and inside, whatever the study and its names."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from autd_analysis.comparisons import COMPARISONS
from autd_analysis.rates import RATES
from autd_analysis.report import fonts
from autd_analysis.report.facets import study_facets, unwritten
from autd_analysis.report.figure_options import DEFAULT, FORMATS, FigureOptions, labelled
from autd_analysis.report.style import figure_style, level_style, save_figure
from autd_analysis.results import Results
from autd_analysis.subject import Subject
from autd_analysis.thresholds import THRESHOLDS
from autd_analysis.timing import TIMING
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from autd_trials.errors import UsageError
from autd_trials.protocol.method import QuestPlusMethod, Range, Staircase
from autd_trials.protocol.schema import Level
from tests.analysis.made_up import made_up, with_method

LONG = (
    "a very long level name indeed",
    "a very long level name of its own",
    "thirdlevelinonewordwithoutend",
    "d",
)
SHORT = ("inner", "outer")
TWELVE = tuple(f"kind number {n} of a dozen" for n in range(1, 13))
ARABIC = ("قطن 25", "صوف 100")
HZ = (25, 100)
STAIRCASE = Staircase(
    kind="staircase",
    varies="drive",
    range=Range(smallest=0.1, largest=1, levels=21),
    start=1,
    felt_to_go_down=2,
)
QUEST = QuestPlusMethod(kind="quest_plus", varies="drive", range=Range(smallest=0.1, largest=1, levels=21))
WIDTHS = [FigureOptions(width=width) for width in (85.0, 174.0)]


def words(figure: Figure) -> Iterator[tuple[str, Bbox]]:
    """Return every text of a laid-out figure and where it stands."""
    beyond = {id(label) for axes in figure.axes for label in unseen(axes)}
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        if text.get_visible() and text.get_text() and id(text) not in beyond:
            yield text.get_text(), text.get_window_extent()


def unseen(axes: Axes) -> Iterator[Text]:
    """Return the labels of ticks beyond the ends of the axes, which nobody sees."""
    for axis in (axes.xaxis, axes.yaxis):
        low, high = sorted(axis.get_view_interval())
        for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
            if not low <= tick.get_loc() <= high:
                yield tick.label1


def said(figure: Figure) -> str:
    return "\n".join(text for text, _ in words(figure))


def squeezed(text: str) -> str:
    """Return a text without what breaking it into lines changes."""
    return "".join(each for each in text if not each.isspace() and each not in "\u2068\u2069")


def tick_labels(axes: Axes) -> list[Bbox]:
    return [label.get_window_extent() for label in axes.get_xticklabels() if label.get_text()]


def dots(figure: Figure) -> int:
    columns = [each for axes in figure.axes for each in axes.collections if isinstance(each, PathCollection)]
    return sum(len(np.asarray(each.get_offsets())) for each in columns)


def drawn(results: Results, subject: Subject[Any], options: FigureOptions) -> Figure:
    """Return the first figure of a subject, laid out; of rates alone where nothing was compared."""
    if subject is COMPARISONS and not results[COMPARISONS]:
        subject = RATES
    with figure_style(study_facets(results.trials.design, options).text):
        figure = next(iter(subject.figures(results[subject], results))).draw(options)
        FigureCanvasAgg(figure)
        figure.draw_without_rendering()
    return figure


@pytest.mark.parametrize("options", WIDTHS, ids=["single", "double"])
@pytest.mark.parametrize(
    ("levels", "compared", "at"),
    [
        ({"clothing": LONG, "modulation_hz": HZ}, "clothing", "modulation_hz"),
        ({"clothing": LONG, "kind_of_stimulus": LONG[:2]}, "kind_of_stimulus", "clothing"),
        ({"clothing": TWELVE}, "clothing", None),
        ({"clothing": ("only",)}, None, None),
        ({"clothing": SHORT, "hand": LONG[:2], "eyes": ("open", "shut")}, "hand", "clothing"),
        ({"clothing": ARABIC, "modulation_hz": HZ}, "clothing", "modulation_hz"),
    ],
)
def test_words_stay_inside_and_apart_and_are_never_cut(
    tmp_path: Path,
    levels: Mapping[str, Sequence[Level]],
    compared: str | None,
    at: str | None,
    options: FigureOptions,
) -> None:
    name = "a study with a name that is far too long for one line of the head of any figure at all"
    study = made_up(tmp_path, levels, compared=compared, at=at, name=name, catch=True)
    figures = [drawn(study, subject, options) for subject in (COMPARISONS, TIMING)]
    figures.append(drawn(with_method(study, STAIRCASE), THRESHOLDS, options))
    for figure in figures:
        page = Bbox.from_bounds(0, 0, *figure.get_size_inches() * figure.dpi)
        for text, box in words(figure):
            assert page.x0 <= box.x0, text
            assert box.x1 <= page.x1, text
            assert page.y0 <= box.y0, text
            assert box.y1 <= page.y1, text
            assert "\N{HORIZONTAL ELLIPSIS}" not in text
        for axes in figure.axes:
            for left, right in itertools.pairwise(tick_labels(axes)):
                assert left.x1 <= right.x0
        whole = squeezed(said(figure))
        shown = [str(level) for its in levels.values() for level in its if len(its) > 1]
        assert all(squeezed(label) in whole for label in shown)


def test_texts_of_a_figure_do_not_touch(tmp_path: Path) -> None:
    levels: dict[str, Sequence[Level]] = {"clothing": LONG, "modulation_hz": HZ, "hand": SHORT}
    study = made_up(tmp_path, levels, compared="clothing", at="modulation_hz")
    for options in WIDTHS:
        boxes = [box for _, box in words(drawn(study, COMPARISONS, options))]
        for one, other in itertools.combinations(boxes, 2):
            overlap = Bbox.intersection(one, other)
            assert overlap is None or min(overlap.width, overlap.height) < 2.5


@pytest.mark.parametrize("people", [1, 60])
def test_no_condition_and_nobody_is_lost(tmp_path: Path, people: int) -> None:
    levels: dict[str, Sequence[Level]] = {
        "clothing": SHORT,
        "modulation_hz": HZ,
        "hand": ("left", "right"),
        "eyes": ("open", "shut"),
    }
    study = made_up(tmp_path, levels, people=people)
    for options in WIDTHS:
        figure = drawn(study, COMPARISONS, options)
        assert len(figure.axes) == 4
        assert dots(figure) == 16 * people
        shown = said(figure)
        assert all(
            f"{name}: {level}" in shown.replace("\n", " ")
            for name, level in [("Eyes", "open"), ("Eyes", "shut")]
        )


def test_levels_that_are_too_many_for_one_panel_have_panels_of_their_own(tmp_path: Path) -> None:
    study = made_up(tmp_path, {"clothing": TWELVE, "modulation_hz": (10, 20, 50, 100)}, people=1)
    facets = study_facets(study.trials.design, WIDTHS[0]).within(2.5)
    assert len(facets.panel_conditions) == 12
    assert [facets.style(panel).colour for panel in facets.panel_conditions[6:8]] == ["#000000", "#0072B2"]


def test_every_level_has_a_style_of_its_own() -> None:
    styles = [level_style(index) for index in range(56)]
    assert len({(style.colour, style.marker) for style in styles}) == 56
    for colours in (
        ("red",),
        ("red", "blue"),
        tuple(f"#{n:02x}0000" for n in range(7)),
        (*"rgbcmyk", "0.5"),
    ):
        own = [level_style(index, colours) for index in range(min(12, 8 * len(colours)))]
        assert len({(style.colour, style.marker) for style in own}) == len(own)


def test_all_figures_of_a_study_have_the_same_colours(tmp_path: Path) -> None:
    study = made_up(
        tmp_path, {"clothing": SHORT, "modulation_hz": HZ}, compared="clothing", at="modulation_hz"
    )
    adaptive = with_method(study, STAIRCASE)
    seen = [
        {
            to_hex(tuple(colour))
            for each in figure.axes[panel].collections
            if isinstance(each, PathCollection)
            for colour in np.asarray(each.get_facecolor()).tolist()
        }
        for figure, panel in (
            (drawn(study, COMPARISONS, DEFAULT), 0),
            (drawn(study, TIMING, DEFAULT), 1),
            (drawn(adaptive, THRESHOLDS, DEFAULT), 0),
        )
    ]
    assert seen[0] == seen[1] == seen[2] == {"#0072b2", "#d55e00"}


def test_participants_are_joined(tmp_path: Path) -> None:
    study = made_up(tmp_path, {"clothing": SHORT}, compared="clothing", people=5)
    for figure in (
        drawn(study, COMPARISONS, DEFAULT),
        drawn(with_method(study, QUEST), THRESHOLDS, DEFAULT),
    ):
        (joined,) = [
            each
            for each in figure.axes[0].collections
            if isinstance(each, LineCollection) and len(each.get_segments()) > 1
        ]
        assert len(joined.get_segments()) == 5


@pytest.mark.parametrize(
    ("method", "rate"), [(STAIRCASE, "felt in 70.7% of trials"), (QUEST, "felt in 50% of trials, guesses")]
)
def test_the_axis_of_thresholds_says_for_which_rate(
    tmp_path: Path, method: Staircase | QuestPlusMethod, rate: str
) -> None:
    study = with_method(made_up(tmp_path, {"clothing": SHORT}), method)
    assert rate in said(drawn(study, THRESHOLDS, DEFAULT)).replace("\n", " ")


def test_names_are_shown_as_they_are_spelt(tmp_path: Path) -> None:
    study = made_up(tmp_path, {"clothing": ("a_b", "a + b", "$\\frac$")})
    shown = said(drawn(study, COMPARISONS, DEFAULT))
    assert {"a_b", "a + b", "$\\frac$"} <= {*shown.split("\n")}


def test_order_labels_and_colours_are_a_persons(tmp_path: Path) -> None:
    study = made_up(tmp_path, {"cloth": ("a", "b", "c"), "freq": HZ})
    options = FigureOptions(
        order={"cloth": ["c"]},
        titles={"freq": "Frequency (Hz)"},
        labels={"cloth": {"a": "bare skin"}, "freq": {"25": "slow"}},
        colours=("#111111", "#777777"),
    )
    facets = study_facets(study.trials.design, options)
    assert [label for _, label in facets.legend] == ["c", "bare skin", "b"]
    assert [(style.colour, style.marker) for style, _ in facets.legend] == [
        ("#111111", "o"),
        ("#777777", "s"),
        ("#111111", "s"),
    ]
    assert facets.ticks == ("slow", "100")
    assert facets.labels.stated("freq", 100.0) == "100\N{NARROW NO-BREAK SPACE}Hz"
    assert "Frequency (Hz)" in said(drawn(study, COMPARISONS, options))


@pytest.mark.parametrize(
    "options",
    [
        {"order": {"cloth": ["x"]}},
        {"order": {"cloth": ["a", "a"]}},
        {"order": {"nothing": ["a"]}},
        {"titles": {"nothing": "A"}},
        {"labels": {"cloth": {"a": "b"}}},
        {"labels": {"cloth": {"a": " "}}},
    ],
)
def test_labels_that_are_wrong_are_refused(tmp_path: Path, options: dict[str, dict[str, str]]) -> None:
    design = made_up(tmp_path, {"cloth": ("a", "b")}).trials.design
    with pytest.raises(UsageError):
        labelled(design, FigureOptions(**options))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "options",
    [
        {"width": 30},
        {"width": 500},
        {"width": "wide"},
        {"formats": ("gif",)},
        {"formats": ()},
        {"colours": ("no",)},
    ],
)
def test_options_that_are_wrong_are_refused(options: dict[str, object]) -> None:
    with pytest.raises(UsageError):
        FigureOptions(**options)  # type: ignore[arg-type]


def test_a_figure_is_as_wide_as_asked_for_and_without_words_if_asked_for(tmp_path: Path) -> None:
    study = made_up(tmp_path, {"clothing": SHORT}, compared="clothing", people=6)
    bare = FigureOptions(width=85, caption=False, test_table=False)
    assert drawn(study, COMPARISONS, bare).get_figwidth() == pytest.approx(85 / 25.4)
    shown = said(drawn(study, COMPARISONS, bare))
    assert "Small markers" not in shown
    assert "Holm" not in shown
    assert "6 participants" not in shown
    with_all = said(drawn(study, COMPARISONS, WIDTHS[0]))
    assert "Small markers" in with_all
    assert "Holm" in with_all


def test_every_format_is_written_twice_the_same(tmp_path: Path) -> None:
    study = made_up(tmp_path, {"clothing": SHORT})
    folders = tmp_path / "one", tmp_path / "other"
    for folder in folders:
        folder.mkdir()
        with figure_style():
            save_figure(drawn(study, COMPARISONS, DEFAULT), folder, "rates", FORMATS)
    for kind in FORMATS:
        one, other = ((folder / f"rates.{kind}").read_bytes() for folder in folders)
        assert one == other
        assert len(one) > 5_000


def test_what_no_font_can_write_is_numbered_and_remarked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fonts, "_known_fonts", dict)
    monkeypatch.setattr(fonts, "_all_fonts", dict)
    study = made_up(tmp_path, {"衣服": ("綿", "絹", "none")}, name="研究")
    shown = said(drawn(study, COMPARISONS, DEFAULT))  # warnings of matplotlib would be errors
    assert not {*"衣服綿絹研究"} & {*shown}
    assert {"Factor 1 1", "Factor 1 2", "none"} <= {*shown.split("\n")}
    (remark,) = unwritten(study.trials.design, DEFAULT)
    assert "Factor 1 1 is 綿" in remark
    assert "Factor 1 2 is 絹" in remark
    assert unwritten(made_up(tmp_path, {"clothing": SHORT}).trials.design, DEFAULT) == ()


def test_fonts_are_chosen_by_the_characters_they_have(monkeypatch: pytest.MonkeyPatch) -> None:
    has = {"DejaVu Sans": "ab", "A": "cd", "B Sans": "cd", "C": "cde", "D": "x"}
    monkeypatch.setattr(fonts, "_known_fonts", lambda: {name: name for name in has if name != "D"})
    monkeypatch.setattr(fonts, "_all_fonts", lambda: {name: name for name in has})
    monkeypatch.setattr(fonts, "_characters", lambda path: frozenset(has[path]))
    monkeypatch.setattr(fonts, "_characters_of", lambda family: frozenset(has[family]))
    assert fonts.families_for("ab") == ("DejaVu Sans",)
    assert fonts.families_for("abcd") == ("DejaVu Sans", "B Sans")
    assert fonts.families_for("abcde") == ("DejaVu Sans", "C")
    assert fonts.families_for("abx") == ("DejaVu Sans", "D")
    assert fonts.unwritable("zay") == "zy"
