"""The results of a study: every subject's outcome, by the subject or by its name."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from autd_analysis.data.trials import Trials
from autd_analysis.report.facets import study_facets
from autd_analysis.report.figure_options import FigureOptions
from autd_analysis.report.style import figure_style
from autd_analysis.report.table import ResultTable
from autd_analysis.subject import Failed, Impossible, NotApplicable, NotComputed, Shown, Subject
from autd_trials.errors import UsageError

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

Found = TypeVar("Found")

_COUNTED = "Only complete trials with an answer are counted; the remarks say what was not counted."


@dataclass(frozen=True, eq=False)
class Outcome(Generic[Found]):
    """What became of a subject.

    Attributes
    ----------
    subject
        Which.
    found
        What it found, or why it found nothing.
    tables, shown
        Of what was found; or why there is nothing to show, also where an error of ours in a table or a
        sentence left the numbers to others.
    asked
        Whether the subject was asked for; else it was computed for another's sake.
    """

    subject: Subject[Found]
    found: Found | NotComputed
    tables: tuple[ResultTable, ...] = ()
    shown: Shown | NotComputed = Shown()  # noqa: RUF009 - frozen
    asked: bool = True

    @property
    def missing(self) -> NotComputed | None:
        """Why there is nothing to show; None if there is something."""
        return next((each for each in (self.found, self.shown) if isinstance(each, NotComputed)), None)


@dataclass(frozen=True, eq=False)
class Results:
    """The results of a study; an attribute for each subject, as ``results.rates``, is a `View` of it.

    Attributes
    ----------
    trials
        The trials, the design, and what is odd about them.
    outcomes
        Of all subjects that were asked for or are needed by those, in the order of the list.
    choice
        What `only` and `without` chose, as options of the command; empty if all.
    options
        What was asked of single subjects besides, by their names.
    not_drawn
        The subjects in whose figures this program made an error.
    of_figures
        Remarks on the figures.
    """

    trials: Trials
    outcomes: tuple[Outcome[Any], ...] = ()
    choice: tuple[str, ...] = ()
    options: Mapping[str, Any] = field(default_factory=dict)
    not_drawn: Mapping[str, Failed] = field(default_factory=dict)
    of_figures: tuple[str, ...] = ()

    def __getitem__(self, subject: Subject[Found]) -> Found:
        """Return what a subject found.

        Raises
        ------
        UsageError
            It found nothing, and why.
        """
        outcome: Outcome[Found] | None = next(
            (each for each in self.outcomes if each.subject is subject), None
        )
        if outcome is None:
            raise UsageError(f"{subject.name} was not computed", do=f"analyse(..., only=[{subject.name!r}])")
        if isinstance(outcome.found, NotComputed):
            raise UsageError(f"{subject.name}: {outcome.found.cause}")
        return outcome.found

    def get(self, subject: Subject[Found]) -> Found | None:
        """Return what a subject found; None if it found nothing."""
        try:
            return self[subject]
        except UsageError:
            return None

    def __getattr__(self, name: str) -> "View[Any]":
        """Return the view of the subject of that name."""
        if not name.startswith("_"):
            for outcome in self.outcomes:
                if outcome.subject.name == name:
                    return View(self, outcome)
        known = ", ".join(outcome.subject.name for outcome in self.outcomes)
        raise AttributeError(f"results have no {name!r}; there are: {known}")

    def __dir__(self) -> list[str]:
        """Return the attributes, subjects among them."""
        return [*super().__dir__(), *(outcome.subject.name for outcome in self.outcomes)]

    def __repr__(self) -> str:
        """Return whose results they are, and of what."""
        return f"Results({self.trials.design.protocol!r}: {', '.join(o.subject.name for o in self.shown)})"

    @property
    def shown(self) -> tuple[Outcome[Any], ...]:
        """The outcomes that were asked for and apply to the study, failed ones among them."""
        return tuple(
            outcome
            for outcome in self.outcomes
            if outcome.asked and not isinstance(outcome.found, NotApplicable)
        )

    @property
    def views(self) -> tuple[Shown, ...]:
        """What the subjects show in words, in their order."""
        return tuple(outcome.shown for outcome in self.shown if isinstance(outcome.shown, Shown))

    @property
    def tables(self) -> tuple[ResultTable, ...]:
        """All tables, in the subjects' order."""
        return tuple(table for outcome in self.shown for table in outcome.tables)

    @property
    def definitions(self) -> dict[str, str]:
        """How each quantity was found, by its name."""
        return {
            "trials": _COUNTED,
            **{
                name: text
                for outcome in self.shown
                if outcome.missing is None
                for name, text in outcome.subject.definitions.items()
            },
        }

    @property
    def failures(self) -> dict[str, Failed]:
        """The subjects in which this program made an error."""
        return {
            **{
                outcome.subject.name: missing
                for outcome in self.outcomes
                if isinstance(missing := outcome.missing, Failed)
            },
            **self.not_drawn,
        }

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a reader should know about the data and the results."""
        of_subjects = (remark for view in self.views for remark in view.remarks)
        return (*self.trials.warnings, *self._not_computed(), *of_subjects, *self.of_figures)

    def _not_computed(self) -> Iterator[str]:
        for outcome in self.outcomes:
            missing = outcome.missing
            by_name = "--only" in self.choice and outcome.asked
            if isinstance(missing, Failed | Impossible) or (missing and by_name):
                yield f"{outcome.subject.name}: {missing.cause}"
        for name, failed in self.not_drawn.items():
            yield f"{name}: {failed.cause}"


@dataclass(frozen=True, eq=False)
class View(Generic[Found]):
    """A subject's results for people: data frames, a figure, a few lines."""

    results: Results
    outcome: Outcome[Found]

    def __repr__(self) -> str:
        """Return the lines that a terminal shows."""
        return self.summary

    @property
    def found(self) -> Found:
        """The numbers themselves, as the subject's ``numbers`` describe them."""
        return self.results[self.outcome.subject]

    @property
    def tables(self) -> "dict[str, pd.DataFrame]":
        """All tables, by name."""
        self._require()
        return {table.name: table.to_frame() for table in self.outcome.tables}

    def to_frame(self, table: str | None = None) -> "pd.DataFrame":
        """Return a table.

        Parameters
        ----------
        table
            Its name, as that of the file that `autd-trials analyse` writes; the subject's first if None.

        Raises
        ------
        UsageError
            There is none of that name, or the subject has no results, and why.
        """
        self._require()
        names = [each.name for each in self.outcome.tables]
        if not names or (table is not None and table not in names):
            raise UsageError(
                f"{self.outcome.subject.name} has no table {table or ''}".rstrip(),
                do=f"one of {', '.join(names)}" if names else None,
            )
        return self.outcome.tables[names.index(table) if table else 0].to_frame()

    def plot(self, ax: "Axes | None" = None, **options: Any) -> "Axes | None":
        """Draw what was found.

        Parameters
        ----------
        ax
            matplotlib's axes to draw on; a figure of its own, in the report's style, if None.
        **options
            Of `autd_analysis.FigureOptions`: ``width``, ``colours``, ``order``, ``titles``, ``labels``, ...

        Returns
        -------
        Axes or None
            What was drawn on: the first panel of a figure. None if there is nothing to draw.
        """
        self._require()
        subject, how = self.outcome.subject, FigureOptions(**options)
        text = study_facets(self.results.trials.design, how).text
        if ax is None:
            with figure_style(text):
                drawn = [each.draw(how) for each in subject.figures(self.found, self.results)]
            return drawn[0].axes[0] if drawn else None
        if subject.plot is None:
            raise UsageError(f"{subject.name} has nothing to draw")
        with figure_style(text):
            subject.plot(self.found, self.results, ax, how)
        return ax

    @property
    def summary(self) -> str:
        """The lines that a terminal shows."""
        shown = self.outcome.shown
        missing = self.outcome.missing
        if missing is not None or isinstance(shown, NotComputed):
            return f"{self.outcome.subject.name}: {missing.cause if missing else ''}"
        return "\n".join(shown.summary)

    def _require(self) -> None:
        if self.outcome.missing is not None:
            raise UsageError(f"{self.outcome.subject.name}: {self.outcome.missing.cause}")
