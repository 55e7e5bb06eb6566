"""What a subject of the analysis is: what it computes, and the tables, figures and words that show it.

A subject is a folder that declares one `Subject` in its ``__init__``; `autd_analysis.study` has the list of
them. Numbers are computed in `Subject.compute` alone, once a run. All else is a view of what was found.
"""

import traceback
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Generic, TypeVar
from typing import Protocol as Interface

from autd_analysis.data.trials import Trials
from autd_analysis.report.figure_options import FigureOptions
from autd_analysis.report.figures import ResultFigure
from autd_analysis.report.table import Declared

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Found = TypeVar("Found")


@dataclass(frozen=True)
class NotComputed:
    """Why a subject has no results, as a clause after its name."""

    cause: str


@dataclass(frozen=True)
class NotApplicable(NotComputed):
    """The study's design has nothing of the kind; said only to those who asked for it by name."""


@dataclass(frozen=True)
class Impossible(NotComputed):
    """The study should have it, but its data do not allow it: a remark."""


@dataclass(frozen=True)
class Failed(NotComputed):
    """An error of this program, with its traceback."""

    traceback: str

    @staticmethod
    def file_name(subject: str) -> str:
        """Return the name of the file where the traceback goes, beside the results."""
        return f"error-{subject}.txt"


@dataclass(frozen=True)
class Answer:
    """Where something was compared (empty: overall), and what was found there."""

    where: str
    sentence: str


@dataclass(frozen=True)
class Shown:
    """What a subject shows of what it found, but for tables and figures.

    Attributes
    ----------
    summary
        Lines for a terminal.
    methods, paragraphs
        Sentences for a manuscript's methods, and paragraphs for its results.
    remarks
        What a reader should know before using the numbers.
    answers
        What was found, a sentence for each planned comparison: a report opens with them.
    """

    summary: tuple[str, ...] = ()
    methods: str = ""
    paragraphs: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    answers: tuple[Answer, ...] = ()


class Others(Interface):
    """The results so far, as a subject takes what others found."""

    @property
    def trials(self) -> Trials:
        """The trials of the study."""

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a reader should know about the data and the results."""

    @property
    def options(self) -> Mapping[str, Any]:
        """What was asked of single subjects besides, by their names."""

    def __getitem__(self, subject: "Subject[Found]") -> Found:
        """Return what a subject found; raises UsageError if it found nothing."""


@dataclass(frozen=True, eq=False)
class Subject(Generic[Found]):
    """A subject of the analysis.

    Attributes
    ----------
    name
        What it is called on the command line and as an attribute of results: a word in small letters.
    title
        What it is about, as a heading.
    compute
        Returns what was found in the trials; it may take what its `needs` found from the results so far.
        `NotApplicable` if the design has nothing of the kind. A `TrialsError` is a remark with its cause; any
        other exception is an error of ours, which is reported, and stops no other subject.
    needs
        The subjects whose results it takes. They are computed also where they were not asked for.
    definitions
        How each of its quantities was found, in a sentence or two that go with every result.
    tables
        Its tables, in order.
    words
        Returns its lines for the terminal, its sentences and paragraphs for a manuscript, and its remarks.
    figures
        Returns its figures. One of the same name as an earlier subject's takes that one's place.
    plot
        Draws what it found on given axes.
    """

    name: str
    title: str
    compute: "Callable[[Trials, Others], Found | NotApplicable]"
    needs: "tuple[Subject[Any], ...]" = ()
    definitions: Mapping[str, str] = field(default_factory=dict)
    tables: tuple[Declared[Found, Any], ...] = ()
    words: Callable[[Found, Trials], Shown] = lambda _found, _trials: Shown()
    figures: "Callable[[Found, Others], Iterable[ResultFigure]]" = lambda _found, _results: ()
    plot: "Callable[[Found, Others, Axes, FigureOptions], None] | None" = None


def failure(subject: str, error: Exception, what: str = "") -> Failed:
    """Return the report of an error of ours, within the handler that caught it.

    Parameters
    ----------
    subject
        The subject's name.
    error
        What was caught.
    what
        Which part is missing, as ``figures rates, timing``; all of the subject if empty.
    """
    kind = f"{type(error).__name__}: {error}".split("\n", maxsplit=1)[0]
    return Failed(
        f"an error of this program ({kind}): {what or 'its results'} are missing, the other subjects stand; "
        f"{Failed.file_name(subject)} has the traceback, please report it",
        traceback.format_exc(),
    )
