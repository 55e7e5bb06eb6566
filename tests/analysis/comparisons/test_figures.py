"""Figures keep their words apart and inside, whatever the levels are called."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import pytest
from autd_analysis.comparisons import COMPARISONS
from autd_analysis.comparisons.figure import draw_comparisons
from autd_analysis.data.any_table import read_any_table
from autd_analysis.data.table_request import TableRequest
from autd_analysis.rates import RATES
from autd_analysis.report.style import figure_style
from autd_analysis.results import Results
from autd_analysis.study import analyse
from autd_analysis.timing import TIMING
from autd_analysis.timing.figure import draw_timing
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from autd_trials.protocol.schema import Comparison, Level

LONG = (
    "a very long level name indeed",
    "another quite long level name",
    "thirdlevelinonewordwithoutend",
    "d",
)
SHORT = ("inner", "outer")


def results(
    tmp_path: Path, levels: Mapping[str, Sequence[Level]], compared: str, at: str | None, people: int = 3
) -> Results:
    """Return the results of a table with every combination of levels, every second trial felt."""
    name = "a study with a name that is far too long for the head of any figure"
    path = tmp_path / f"{name}.csv"
    rows = [
        ",".join(map(str, (f"p{person}", trial % 2, 0.3 + person / 10, *cell)))
        for person in range(people)
        for cell in itertools.product(*levels.values())
        for trial in range(4)
    ]
    path.write_text(
        "\n".join([",".join(("participant", "response", "response_time", *levels)), *rows]) + "\n"
    )
    names = ("participant", "response", "response_time", *levels)
    first, second = levels[compared][:2]
    comparison = Comparison.model_construct(factor=compared, first=str(first), second=str(second), at_each=at)
    request = TableRequest(
        {name: name for name in names},
        {name: tuple(map(str, each)) for name, each in levels.items()},
        (comparison,),
    )
    return analyse(read_any_table([path], request), only=["rates", "comparisons", "timing"])


def result_figure(study: Results) -> Figure:
    return draw_comparisons(study[COMPARISONS], study[RATES], study)


def words(figure: Figure) -> Iterator[tuple[str, Bbox]]:
    """Return every text of a drawn figure and where it stands."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()  # type: ignore[no-untyped-call]
    renderer = canvas.get_renderer()  # type: ignore[no-untyped-call]
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        if text.get_visible() and text.get_text():
            yield text.get_text(), text.get_window_extent(renderer)


def tick_labels(axes: Axes) -> list[Bbox]:
    return [label.get_window_extent() for label in axes.get_xticklabels() if label.get_text()]


@pytest.mark.parametrize(
    ("levels", "compared", "at"),
    [
        ({"clothing": LONG, "modulation_hz": (25, 100)}, "clothing", "modulation_hz"),
        ({"clothing": LONG, "kind_of_stimulus": SHORT}, "kind_of_stimulus", "clothing"),
        ({"clothing": LONG, "kind_of_stimulus": LONG}, "kind_of_stimulus", "clothing"),
        ({"clothing": SHORT, "modulation_hz": tuple(range(10, 130, 10))}, "clothing", "modulation_hz"),
        ({"clothing": LONG}, "clothing", None),
    ],
)
def test_long_words_and_many_levels_fit(
    tmp_path: Path, levels: Mapping[str, Sequence[Level]], compared: str, at: str | None
) -> None:
    study = results(tmp_path, levels, compared, at)
    with figure_style():
        for figure in (result_figure(study), draw_timing(study[TIMING], study.trials)):
            page = Bbox.from_bounds(0, 0, *figure.get_size_inches() * figure.dpi)
            for text, box in words(figure):
                assert page.x0 <= box.x0, text
                assert box.x1 <= page.x1, text
                assert page.y0 <= box.y0, text
                assert box.y1 <= page.y1, text
            for axes in figure.axes:
                for left, right in itertools.pairwise(tick_labels(axes)):
                    assert left.x1 <= right.x0


def test_a_dollar_is_a_dollar(tmp_path: Path) -> None:
    study = results(tmp_path, {"price": ("$\\frac$", "$1$")}, "price", None)
    with figure_style():
        assert "$\\frac$" in [text for text, _ in words(result_figure(study))]
