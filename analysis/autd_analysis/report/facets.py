"""What a figure shows where: a factor along the axis, one by colour, a panel for each level of the others."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

from autd_analysis.data.design import Condition, Design, StudyFactor, conditions
from autd_analysis.report.figure_options import FigureOptions, labelled
from autd_analysis.report.fonts import unwritable
from autd_analysis.report.style import PLAIN, Style, level_style
from autd_analysis.report.wording import Labels, isolated, study_labels
from autd_trials.errors import UsageError
from autd_trials.protocol.schema import Level

Cell = frozenset[tuple[str, Level]]
"""A condition whatever the order of its factors."""

_NARROWEST_COLUMN_IN = 0.09


@dataclass(frozen=True)
class Facets:
    """Where each condition of a study is shown; no factor is averaged over.

    Attributes
    ----------
    x
        The factor along the axis; None if there is none.
    colour
        The factor shown by colour and marker, the same in all figures of a study.
    panels
        The factors that have a panel for each combination of their levels.
    held
        Factors with one level, which need not be shown.
    labels
        What everything is called.
    colours
        A person's colours.
    study
        The study's name.
    text
        All names that are written, for which fonts are chosen.
    apart
        Whether the levels of `colour` have panels of their own, as they are too many to stand side by side.
    """

    x: StudyFactor | None
    colour: StudyFactor | None
    panels: tuple[StudyFactor, ...]
    held: Condition
    labels: Labels
    colours: tuple[str, ...]
    study: str
    text: str
    apart: bool = False

    @property
    def places(self) -> tuple[Condition, ...]:
        """The places along the axis; one empty one without a factor."""
        return conditions([self.x] if self.x else [])

    @property
    def side_by_side(self) -> tuple[Condition, ...]:
        """What stands side by side at each place."""
        return conditions([self.colour] if self.colour and not self.apart else [])

    @property
    def panel_conditions(self) -> tuple[Condition, ...]:
        """What each panel is of."""
        return conditions(self._panel_factors)

    @property
    def columns(self) -> int:
        """How many panels are best in a row: the levels of the last of several factors."""
        factors = self._panel_factors
        return len(factors[-1].levels) if len(factors) > 1 else 0

    @property
    def ticks(self) -> tuple[str, ...]:
        """The labels of the places."""
        return (
            tuple(self.labels.level(self.x.name, level) for level in self.x.levels)
            if self.x
            else ("all stimuli",)
        )

    @property
    def x_label(self) -> str:
        """The label of the axis."""
        return self.labels.title(self.x.name) if self.x else ""

    @property
    def legend(self) -> tuple[tuple[Style, str], ...]:
        """The styles of the levels that colour shows."""
        if self.colour is None:
            return ()
        name = self.colour.name
        return tuple(
            (self.style(((name, level),)), self.labels.quantity(name, level)) for level in self.colour.levels
        )

    def cell(self, *parts: Condition) -> Cell:
        """Return the condition that has these levels, and those of the factors that are held."""
        return frozenset(pair for part in (*parts, self.held) for pair in part)

    def style(self, *parts: Condition) -> Style:
        """Return the style of a condition."""
        if self.colour is None:
            return PLAIN
        levels = {level for part in parts for name, level in part if name == self.colour.name}
        return level_style(self.colour.levels.index(levels.pop()), self.colours) if levels else PLAIN

    def strip(self, condition: Condition) -> str:
        """Return what stands above a panel; empty where there is one."""
        return ", ".join(self.labels.strip(name, level) for name, level in condition)

    def least_in(self, places: int, columns: int) -> float:
        """Return the least width of a panel with so many places of so many columns."""
        return places * max(0.24 if columns > 1 else 0.16, columns * _NARROWEST_COLUMN_IN)

    def within(self, room_in: float) -> "Facets":
        """Return the facets for panels that are at most so wide."""
        columns = len(self.places) * len(self.side_by_side)
        return dataclasses.replace(self, apart=columns * _NARROWEST_COLUMN_IN > room_in)

    def along(self, factor: str) -> "Facets":
        """Return the facets of functions of a factor: a panel for each combination of all others."""
        rest = [each for each in (*self.panels, self.x, self.colour) if each and each.name != factor]
        held = tuple(pair for pair in self.held if pair[0] != factor)
        return dataclasses.replace(self, x=None, panels=tuple(rest), held=held, apart=False)

    @property
    def _panel_factors(self) -> Sequence[StudyFactor]:
        apart = self.colour if self.apart else None
        return [*self.panels, *([apart] if apart else [])]


def study_facets(design: Design, options: FigureOptions) -> Facets:
    """Return what the figures of a study show where.

    The first planned comparison decides: its two levels stand side by side in two colours, at each level of
    the other factor along the axis. Without one, numbers stand along the axis and words have colours.

    Parameters
    ----------
    design
        The study's design.
    options
        Order and names of levels, and colours.
    """
    chosen = labelled(design, options)
    varied = [factor for factor in chosen.factors if len(factor.levels) > 1]
    x, colour = _shown(chosen, varied)
    labels, _ = _writable(study_labels(chosen))
    study = chosen.protocol if not unwritable(chosen.protocol) else "study"
    return Facets(
        x=x,
        colour=colour,
        panels=tuple(factor for factor in varied if factor not in (x, colour)),
        held=tuple((factor.name, factor.levels[0]) for factor in chosen.factors if factor not in varied),
        labels=labels,
        colours=options.colours,
        study=isolated(study),
        text="".join(
            [
                study,
                *labels.titles.values(),
                *(each for its in labels.levels.values() for each in its.values()),
            ]
        ),
    )


def single_panel(facets: Facets) -> Facets:
    """Return facets whose figure has one panel, as on axes that a person gave.

    Raises
    ------
    UsageError
        It has several: the others would be missing.
    """
    if facets.panels:
        names = ", ".join(factor.name for factor in facets.panels)
        raise UsageError(
            f"there is a panel for each level of {names}, which do not fit on one pair of axes",
            do="leave ax out: a figure of its own has them all",
        )
    return facets


def unwritten(design: Design, options: FigureOptions) -> tuple[str, ...]:
    """Return remarks on names that no installed font can write, and what figures say instead.

    Parameters
    ----------
    design, options
        As of `study_facets`.
    """
    _, replaced = _writable(study_labels(labelled(design, options)))
    if not replaced:
        return ()
    lacking = unwritable("".join(replaced))
    named = "; ".join(f"{instead} is {isolated(name)}" for name, instead in replaced.items())
    return (
        f"No installed font has {' '.join(lacking)}, so that figures number what they cannot write: {named}. "
        "Install a font that has them (Noto Sans CJK for Japanese and Chinese, say) or give "
        "other labels (--labels).",
    )


def _writable(labels: Labels) -> tuple[Labels, dict[str, str]]:
    """Return labels that can be written, and what stands instead of those that cannot."""
    replaced: dict[str, str] = {}

    def written(name: str, instead: str) -> str:
        if unwritable(name):
            replaced[name] = instead
            return instead
        return name

    titles = {
        factor: written(title, f"Factor {number}")
        for number, (factor, title) in enumerate(labels.titles.items(), start=1)
    }
    levels = {
        factor: {
            level: written(label, f"{titles[factor].partition(' (')[0]} {number}")
            for number, (level, label) in enumerate(its_levels.items(), start=1)
        }
        for factor, its_levels in labels.levels.items()
    }
    return Labels(titles, levels), replaced


def _shown(design: Design, varied: Sequence[StudyFactor]) -> tuple[StudyFactor | None, StudyFactor | None]:
    compared = design.comparisons[0] if design.comparisons else None
    names = {factor.name: factor for factor in varied}
    if len(varied) < 2:
        return (varied[0] if varied else None), None
    if compared is not None and compared.factor in names:
        colour = names[compared.factor]
        others = [factor for factor in varied if factor != colour]
        return names.get(compared.at_each or "", _best_axis(others)), colour
    x = _best_axis(varied)
    others = [factor for factor in varied if factor != x]
    return x, next((factor for factor in others if not factor.within_block), others[0])


def _best_axis(factors: Sequence[StudyFactor]) -> StudyFactor:
    """Return the first factor of numbers, preferably one that varies within blocks; else the first."""
    numbers = [factor for factor in factors if all(isinstance(level, float) for level in factor.levels)]
    return next((factor for factor in numbers if factor.within_block), (numbers or list(factors))[0])
