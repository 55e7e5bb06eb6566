"""What a person may choose of the figures: width, colours, order and names of levels, texts, formats."""

import dataclasses
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from autd_analysis.data.design import Design, StudyFactor
from autd_analysis.data.trials import Trials
from autd_trials.errors import UsageError
from autd_trials.protocol.schema import Level
from autd_trials.tables import level_text

FORMATS = ("png", "svg", "pdf", "tiff")
"""What figures can be saved as."""

WIDTHS_MM: Mapping[str, float] = {"single": 85.0, "middle": 114.0, "double": 174.0}
"""Widths of one, of one and a half and of two columns, as Cell Press asks for them. Others are given as
numbers: Elsevier's are 90, 140 and 190 mm, Nature's 89 and 183 mm."""

NARROWEST_MM, WIDEST_MM = 60.0, 400.0


@dataclass(frozen=True)
class FigureOptions:
    """How figures are made.

    Attributes
    ----------
    width
        Width in mm, 60 to 400, or a column's name: ``single``, ``middle`` or ``double``.
    colours
        Colours in the order of the levels that colour shows, as matplotlib knows them
        (``"#0072B2"``, ``"tab:blue"``); without any, Okabe and Ito's. With fewer colours than levels they
        come again with other markers.
    order
        Levels of factors in the order in which they are shown; levels that are not named come after them.
    titles
        What factors are called.
    labels
        What levels are called: factor, then level as tables spell it, then the words.
    caption
        Whether a figure says below itself how to read it.
    test_table
        Whether the figure of rates has the tests below it.
    formats
        Of `FORMATS`, one or more.

    Raises
    ------
    UsageError
        A value is none of these.
    """

    width: float | str = "double"
    colours: tuple[str, ...] = ()
    order: Mapping[str, Sequence[str]] = field(default_factory=dict)
    titles: Mapping[str, str] = field(default_factory=dict)
    labels: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    caption: bool = True
    test_table: bool = True
    formats: tuple[str, ...] = ("png", "svg", "pdf")

    def __post_init__(self) -> None:
        if not NARROWEST_MM <= self.width_mm <= WIDEST_MM:
            raise UsageError(
                f"a figure cannot be {self.width_mm:g} mm wide",
                do=f"give {NARROWEST_MM:g} to {WIDEST_MM:g} mm, or {_listed(WIDTHS_MM)}",
            )
        unknown = [each for each in self.formats if each not in FORMATS]
        if unknown or not self.formats:
            raise UsageError(
                f"figures cannot be saved as {_listed(unknown) or 'nothing'}", do=f"name {_listed(FORMATS)}"
            )
        if self.colours:
            _require_colours(self.colours)

    @property
    def width_mm(self) -> float:
        """The width in mm."""
        try:
            return WIDTHS_MM[self.width] if self.width in WIDTHS_MM else float(self.width)  # type: ignore[index]
        except ValueError as error:
            raise UsageError(
                f"a figure's width cannot be {self.width!r}",
                do=f"give {_listed(WIDTHS_MM)}, or a number of mm",
            ) from error

    @property
    def width_in(self) -> float:
        """The width in inches."""
        return self.width_mm / 25.4


DEFAULT = FigureOptions()


def labelled(design: Design, options: FigureOptions) -> Design:
    """Return a design with the order of levels and the names that a person chose.

    Raises
    ------
    UsageError
        There is no such factor or level, or two levels of a factor are called the same.
    """
    for option, named in (("order", options.order), ("labels", {**options.titles, **options.labels})):
        unknown = [name for name in named if name not in {factor.name for factor in design.factors}]
        if unknown:
            raise UsageError(
                f"the {option} of figures: there is no factor {_listed(unknown)}",
                do=f"name {_listed(factor.name for factor in design.factors) or 'none, as there is none'}",
            )
    return dataclasses.replace(design, factors=tuple(_labelled(factor, options) for factor in design.factors))


def labelled_trials(trials: Trials, options: FigureOptions) -> Trials:
    """Return trials with the order of levels and the names that a person chose, for all that is made of them.

    Raises
    ------
    UsageError
        As of `labelled`.
    """
    command = " ".join(filter(None, (trials.command, shlex.join(_arguments(options)))))
    return dataclasses.replace(trials, design=labelled(trials.design, options), command=command)


def _arguments(options: FigureOptions) -> Iterator[str]:
    """Yield what a person types for these options."""
    if options.width != DEFAULT.width:
        yield from ("--figure-width", str(options.width))
    if options.colours:
        yield from ("--colours", ",".join(options.colours))
    for factor, levels in options.order.items():
        yield from ("--order", f"{factor}={','.join(map(_quoted, levels))}")
    for factor, title in options.titles.items():
        yield from ("--labels", f"{factor}={title}")
    for factor, labels in options.labels.items():
        for level, words in labels.items():
            yield from ("--labels", f"{factor}:{level}={words}")
    if not options.caption:
        yield "--no-caption"
    if not options.test_table:
        yield "--no-test-table"
    if options.formats != DEFAULT.formats:
        yield from ("--format", ",".join(options.formats))


def _quoted(word: str) -> str:
    return f'"{word}"' if "," in word else word


def _labelled(factor: StudyFactor, options: FigureOptions) -> StudyFactor:
    first = [_level(factor, text) for text in options.order.get(factor.name, ())]
    if len(set(first)) < len(first):
        raise UsageError(f"the order of {factor.name} names a level twice", do="name each once")
    said = {_level(factor, level): words for level, words in options.labels.get(factor.name, {}).items()}
    labels = {**factor.labels, **said}
    for level, words in said.items():
        others = [each for each in factor.levels if each != level]
        if not words.strip() or words in [labels.get(each, level_text(each)) for each in others]:
            raise UsageError(
                f"the labels of {factor.name}: {words!r} does not distinguish its levels",
                do="give each level words of its own",
            )
    return dataclasses.replace(
        factor,
        levels=(*first, *(level for level in factor.levels if level not in first)),
        title=options.titles.get(factor.name, factor.title),
        labels=labels,
    )


def _level(factor: StudyFactor, text: str) -> Level:
    level = factor.parse(text)
    if level is None:
        raise UsageError(
            f"{factor.name} has no level {text!r}",
            do=f"its levels are {_listed(map(level_text, factor.levels))}",
        )
    return level


def _require_colours(colours: Sequence[str]) -> None:
    from matplotlib.colors import is_color_like

    unknown = [colour for colour in colours if not is_color_like(colour)]
    if unknown:
        raise UsageError(
            f"not a colour: {_listed(unknown)}",
            do="give colours as matplotlib knows them: '#0072B2', tab:blue",
        )


def _listed(words: Iterable[str]) -> str:
    return ", ".join(words)
