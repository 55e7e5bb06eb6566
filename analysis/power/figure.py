"""The power curve: how likely each planned comparison is found, against the number of participants."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from analysis.power.run import PowerRow

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_NAMES = {"sign_flip": "exact sign-flip", "paired_t": "paired t", "mixed_model": "mixed model"}


def draw_power(rows: Sequence[PowerRow], alpha: float, about: str, stem: Path) -> list[Path]:
    """Draw a panel for each test into ``stem.png`` and ``stem.svg``; return both.

    Bands are 95 % Monte Carlo intervals; dotted lines are false positives in studies without a difference.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    tests = list(dict.fromkeys(row.test for row in rows))
    figure = Figure(figsize=(1 + 3.6 * len(tests), 3.8), layout="constrained")
    panels = figure.subplots(1, len(tests), sharey=True, squeeze=False)[0]
    for axes, test in zip(panels, tests, strict=True):
        _draw_test(axes, [row for row in rows if row.test == test], alpha)
        axes.set_title(_NAMES[test], fontsize=10)
    panels[0].set_ylabel("share of studies that find it")
    panels[-1].legend(frameon=False, fontsize=7, loc="center right")
    figure.suptitle(about, x=0.01, ha="left", fontsize=9)
    paths = [stem.with_name(f"{stem.name}.{suffix}") for suffix in ("png", "svg")]
    with mpl.rc_context({"svg.hashsalt": "autd_trials"}):
        figure.savefig(paths[0], dpi=150)
        figure.savefig(paths[1], metadata={"Date": None})
    return paths


def _draw_test(axes: "Axes", rows: Sequence[PowerRow], alpha: float) -> None:
    comparisons = dict.fromkeys(row.comparison for row in rows)
    for comparison, colour in zip(comparisons, _COLOURS, strict=False):
        mine = [row for row in rows if row.comparison == comparison]
        sizes = [row.participants for row in mine]
        intervals = [row.power_interval for row in mine]
        low = [interval.low for interval in intervals if interval]
        high = [interval.high for interval in intervals if interval]
        axes.fill_between(sizes, low, high, color=colour, alpha=0.25, linewidth=0)
        axes.plot(sizes, [row.power for row in mine], "o-", markersize=3, color=colour, label=comparison)
        axes.plot(sizes, [row.false_positives for row in mine], ":", color=colour)
    axes.axhline(alpha, color="0.6", linewidth=0.8)
    axes.axhline(0.8, color="0.8", linewidth=0.8)
    axes.set(xlabel="participants", ylim=(0, 1.02))
