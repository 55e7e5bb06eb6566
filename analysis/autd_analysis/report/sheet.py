"""A figure as a sheet: head, legend, groups of panels, table and caption, all measured before it is drawn."""

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from autd_analysis.report.figure_options import FigureOptions
from autd_analysis.report.lettering import (
    TickLabels,
    all_broken,
    bold_face,
    broken,
    line_in,
    tick_labels,
    width_in,
)
from autd_analysis.report.style import BAND, INK, NOTE, SIGNAL, Style
from autd_analysis.report.wording import SIMULATED

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MARGIN_IN = 0.08
_GAP_IN = 0.12  # between panels of a group
_BETWEEN_IN = 0.22  # between groups side by side
_Y_AXIS_IN = 0.62  # label and numbers beside the first panel of a row
_X_AXIS_IN = 0.2  # numbers below a panel whose axis has numbers
_TICKS_GAP_IN = 0.06
_TITLE_SIZE, _HEAD_SIZE, _STRIP_SIZE, _NOTE_SIZE, _LEGEND_SIZE, _TABLE_SIZE = 8.0, 9.0, 7.0, 7.0, 8.0, 7.0
_BADGE_SIZE = 8.0
_HANDLE_IN = 0.34  # a legend's symbol with the gap behind it
_CELL_GAP_IN = 0.14
_FIRST_CELL = 0.42  # most of the width that a table's first column takes

Table = Sequence[Sequence[str]]
"""Rows of cells; the first two are headings, the first cell of a row is its name."""


@dataclass(frozen=True)
class Panel:
    """Axes to be drawn, and what a strip above them says of them."""

    draw: "Callable[[Axes], None]"
    strip: str = ""


@dataclass(frozen=True)
class Group:
    """Panels with the same axes.

    Attributes
    ----------
    title, x_label, y_label
        What they show.
    panels
        One for each facet.
    height_in
        Of a panel.
    least_in
        Least width of a panel.
    ticks
        Labels of the places along x; none where it has numbers.
    columns
        How many panels are best in a row; 0 if that is all the same.
    weight
        How much of the width that is left a panel takes.
    """

    title: str
    x_label: str
    y_label: str
    panels: Sequence[Panel]
    height_in: float
    least_in: float
    ticks: Sequence[str] = ()
    columns: int = 0
    weight: float = 1.0


@dataclass(frozen=True)
class Sheet:
    """All that a figure has.

    Attributes
    ----------
    head
        Which study it is and what of it.
    simulated
        Whether the participants were simulated.
    legend
        Styles and what they stand for.
    groups
        The panels.
    table
        Below them; may be empty.
    caption
        How to read the figure, a sentence or more each.
    """

    head: str
    simulated: bool
    legend: Sequence[tuple[Style, str]]
    groups: Sequence[Group]
    table: Table = ()
    caption: Sequence[str] = ()

    def draw(self, options: FigureOptions) -> "Figure":
        """Return the figure, within `autd_analysis.report.style.figure_style`; it is bound to no window."""
        return _Drawing(self, options).figure()


@dataclass(frozen=True)
class _Block:
    """A group with its place: widths and heights in inches."""

    group: Group
    letter: str
    left_in: float
    panel_in: float
    columns: int
    ticks: TickLabels | None
    strip_lines: tuple[tuple[str, ...], ...]
    strip_in: float

    @property
    def rows(self) -> int:
        return math.ceil(len(self.group.panels) / self.columns)

    @property
    def row_in(self) -> float:
        return self.strip_in + self.group.height_in

    @property
    def axis_in(self) -> float:
        ticks_in = self.ticks.height_in + _TICKS_GAP_IN if self.ticks else _X_AXIS_IN
        label = broken(self.group.x_label, self.width_in, 8) if self.group.x_label else []
        return ticks_in + len(label) * line_in(8)

    @property
    def width_in(self) -> float:
        return self.columns * self.panel_in + (self.columns - 1) * _GAP_IN

    @property
    def height_in(self) -> float:
        return _title_in() + self.rows * self.row_in + (self.rows - 1) * _GAP_IN + self.axis_in


class _Drawing:
    """What is measured first and then drawn from the top downwards."""

    def __init__(self, sheet: Sheet, options: FigureOptions) -> None:
        self._sheet = sheet
        self._width_in = options.width_in
        self._room_in = options.width_in - 2 * _MARGIN_IN
        self._caption = all_broken(sheet.caption, self._room_in, _NOTE_SIZE) if options.caption else ()
        self._tables = _fitted(sheet.table, self._room_in) if options.test_table and sheet.table else []
        self._head = broken(sheet.head, self._room_in, _HEAD_SIZE, bold=True) if options.caption else []
        self._badge_below = (
            sheet.simulated
            and bool(self._head)
            and (
                width_in(self._head[0], _HEAD_SIZE, bold=True)
                + width_in(SIMULATED, _BADGE_SIZE, bold=True)
                + 0.4
                > self._room_in
            )
        )
        self._legend = _Legend(sheet.legend, self._room_in)
        self._lines = _arranged(sheet.groups, self._room_in)

    def figure(self) -> "Figure":
        from matplotlib.figure import Figure

        head_lines = max(len(self._head), self._sheet.simulated) + 1.3 * self._badge_below
        head_in = 0.08 + head_lines * line_in(_HEAD_SIZE) + 0.1 * (head_lines > 0)
        blocks_in = sum(max(block.height_in for block in line) + _BETWEEN_IN for line in self._lines)
        tables_in = sum(len(table.rows) * line_in(_TABLE_SIZE) + 0.22 for table in self._tables)
        caption_in = len(self._caption) * line_in(_NOTE_SIZE)
        height_in = head_in + self._legend.height_in + blocks_in + tables_in + caption_in + 0.02
        figure = Figure(figsize=(self._width_in, height_in))
        page = _Page(figure)
        self._draw_head(page)
        y_in = height_in - head_in
        self._legend.draw(page, y_in)
        y_in -= self._legend.height_in
        for line in self._lines:
            for block in line:
                _draw_block(page, block, y_in)
            y_in -= max(block.height_in for block in line) + _BETWEEN_IN
        for table in self._tables:
            table.draw(page, y_in, self._width_in)
            y_in -= len(table.rows) * line_in(_TABLE_SIZE) + 0.22
        for number, text in enumerate(self._caption):
            page.text(_MARGIN_IN, y_in - (number + 0.5) * line_in(_NOTE_SIZE), text, _NOTE_SIZE, color=NOTE)
        return figure

    def _draw_head(self, page: "_Page") -> None:
        line = line_in(_HEAD_SIZE)
        first = page.height_in - 0.08 - line / 2
        for number, text in enumerate(self._head):
            page.text(_MARGIN_IN, first - number * line, text, _HEAD_SIZE, **bold_face(text))
        if self._sheet.simulated:
            below = self._badge_below
            page.text(
                _MARGIN_IN + 0.05 if below else self._width_in - _MARGIN_IN - 0.05,
                first - (len(self._head) + 0.2) * line if below else first,
                SIMULATED,
                _BADGE_SIZE,
                **bold_face(SIMULATED),
                color=SIGNAL,
                ha="left" if below else "right",
                bbox={
                    "boxstyle": "round,pad=0.3",
                    "facecolor": "none",
                    "edgecolor": SIGNAL,
                    "linewidth": 0.8,
                },
            )


class _Page:
    """A figure that is written on in inches from its lower left corner."""

    def __init__(self, figure: "Figure") -> None:
        self.figure = figure
        self.width_in, self.height_in = (float(size) for size in figure.get_size_inches())

    def text(self, x_in: float, y_in: float, text: str, size: float, **how: object) -> None:
        style = {"va": "center", **how}
        self.figure.text(x_in / self.width_in, y_in / self.height_in, text, fontsize=size, **style)  # type: ignore[arg-type]

    def axes(self, left_in: float, bottom_in: float, panel_in: float, height_in: float) -> "Axes":
        return self.figure.add_axes(
            (
                left_in / self.width_in,
                bottom_in / self.height_in,
                panel_in / self.width_in,
                height_in / self.height_in,
            )
        )

    def line(self, x_in: Sequence[float], y_in: Sequence[float], **how: object) -> None:
        from matplotlib.lines import Line2D

        x, y = [each / self.width_in for each in x_in], [each / self.height_in for each in y_in]
        self.figure.add_artist(Line2D(x, y, **how))  # type: ignore[arg-type]


class _Legend:
    """Symbols and what they stand for, in as many columns as fit."""

    def __init__(self, entries: Sequence[tuple[Style, str]], room_in: float) -> None:
        self._styles = [style for style, _ in entries]
        widest = max((width_in(label, _LEGEND_SIZE) for _, label in entries), default=0.0)
        self._columns = max(1, int(room_in / (widest + _HANDLE_IN + 0.15)))
        self._column_in = room_in if self._columns == 1 else widest + _HANDLE_IN + 0.15
        self._labels = [broken(label, room_in - _HANDLE_IN, _LEGEND_SIZE) for _, label in entries]
        lines = [
            max(map(len, self._labels[row : row + self._columns]))
            for row in range(0, len(entries), self._columns)
        ]
        self._row_tops = [sum(lines[:row]) for row in range(len(lines))]
        self.height_in = sum(lines) * line_in(_LEGEND_SIZE) + 0.08 if entries else 0.0

    def draw(self, page: _Page, top_in: float) -> None:
        line = line_in(_LEGEND_SIZE)
        for number, (style, label) in enumerate(zip(self._styles, self._labels, strict=True)):
            row, column = divmod(number, self._columns)
            x_in = _MARGIN_IN + column * self._column_in
            y_in = top_in - (self._row_tops[row] + 0.5) * line
            page.line([x_in + 0.02, x_in + 0.24], [y_in, y_in], color=style.colour, linewidth=1.8)
            page.line(
                [x_in + 0.13],
                [y_in],
                color=style.colour,
                marker=style.marker,
                markerfacecolor=style.fill,
                markersize=6,
            )
            for below, text in enumerate(label):
                page.text(x_in + _HANDLE_IN - 0.04, y_in - below * line, text, _LEGEND_SIZE)


@dataclass(frozen=True)
class _FittedTable:
    """Rows of a table with the left ends of its columns."""

    rows: tuple[tuple[str, ...], ...]
    lefts_in: tuple[float, ...]

    def draw(self, page: _Page, top_in: float, width_in: float) -> None:
        line, right_in = line_in(_TABLE_SIZE), width_in - _MARGIN_IN
        y_in = top_in - 0.06
        rule = {"color": INK, "linewidth": 0.6}
        page.line([_MARGIN_IN, right_in], [y_in, y_in], **rule)
        for number, row in enumerate(self.rows):
            for left_in, cell in zip(self.lefts_in, row, strict=True):
                page.text(left_in, y_in - 0.02 - (number + 0.5) * line, cell, _TABLE_SIZE)
            if number == 1:
                below_in = y_in - 0.02 - 2 * line
                page.line([_MARGIN_IN, right_in], [below_in, below_in], **rule)
        end_in = y_in - 0.03 - len(self.rows) * line
        page.line([_MARGIN_IN, right_in], [end_in, end_in], **rule)


def _fitted(table: Table, room_in: float) -> list[_FittedTable]:
    """Return a table as tables below each other that fit into a width; each repeats the first column.

    Columns under one heading stay together.
    """
    names_in = min(max(width_in(row[0], _TABLE_SIZE) for row in table), _FIRST_CELL * room_in)
    widths = [
        max(width_in(row[column], _TABLE_SIZE) for row in table) + _CELL_GAP_IN
        for column in range(1, len(table[0]))
    ]
    room_in -= names_in + _CELL_GAP_IN
    begun = [column for column in range(len(widths)) if table[0][column + 1] or not column]
    starts = [0]
    for column, following in zip(begun, [*begun[1:], len(widths)], strict=True):
        if column and sum(widths[starts[-1] : following]) > room_in:
            starts.append(column)
    return [
        _block_of(table, names_in, widths, range(start, end), room_in)
        for start, end in zip(starts, [*starts[1:], len(widths)], strict=True)
    ]


def _block_of(
    table: Table, names_in: float, widths: Sequence[float], columns: range, room_in: float
) -> _FittedTable:
    spare_in = room_in - sum(widths[column] for column in columns)
    gap_in = max(0.0, spare_in) / max(1, len(columns))
    left_in, lefts_in = _MARGIN_IN + names_in + _CELL_GAP_IN + gap_in / 2, [_MARGIN_IN]
    for column in columns:
        lefts_in.append(left_in)
        left_in += widths[column] + gap_in
    rows: list[tuple[str, ...]] = []
    for row in table:
        first, *more = broken(row[0], names_in + 0.01, _TABLE_SIZE)
        rows.append((first, *(row[column + 1] for column in columns)))
        rows += [(text, *("" for _ in columns)) for text in more]
    return _FittedTable(tuple(rows), tuple(lefts_in))


def _title_in() -> float:
    return line_in(_TITLE_SIZE) + 0.06


def _arranged(groups: Sequence[Group], room_in: float) -> list[list[_Block]]:
    """Return groups in lines: side by side where all their panels fit in one row."""
    lines: list[list[Group]] = []
    for group in groups:
        if (
            lines
            and sum(_least_in(each) for each in (*lines[-1], group)) + _BETWEEN_IN * len(lines[-1]) <= room_in
        ):
            lines[-1].append(group)
        else:
            lines.append([group])
    letters = iter("ABCDEFGH")
    return [_line(line, room_in, letters) for line in lines]


def _least_in(group: Group) -> float:
    """Return the width that a group needs with all its panels in one row."""
    panels = len(group.panels)
    return _Y_AXIS_IN + panels * group.least_in + (panels - 1) * _GAP_IN


def _line(groups: Sequence[Group], room_in: float, letters: Iterator[str]) -> list[_Block]:
    columns = [_columns(group, room_in) if len(groups) == 1 else len(group.panels) for group in groups]
    fixed_in = sum(_Y_AXIS_IN + (each - 1) * _GAP_IN for each in columns) + _BETWEEN_IN * (len(groups) - 1)
    least_in = sum(each * group.least_in for each, group in zip(columns, groups, strict=True))
    shares = sum(each * group.weight for each, group in zip(columns, groups, strict=True))
    spare_in = max(0.0, room_in - fixed_in - least_in) / shares
    blocks, left_in = [], _MARGIN_IN
    for each, group in zip(columns, groups, strict=True):
        panel_in = min(group.least_in + spare_in * group.weight, (room_in - fixed_in) / each)
        ticks = tick_labels(group.ticks, panel_in / len(group.ticks)) if group.ticks else None
        strips = tuple(
            tuple(broken(panel.strip, panel_in - 0.06, _STRIP_SIZE)) if panel.strip else ()
            for panel in group.panels
        )
        most = max(map(len, strips))
        strip_in = most * line_in(_STRIP_SIZE) + 0.05 if most else 0.0
        block = _Block(group, next(letters), left_in + _Y_AXIS_IN, panel_in, each, ticks, strips, strip_in)
        blocks.append(block)
        left_in = block.left_in + block.width_in + _BETWEEN_IN
    highest = max(block.strip_in for block in blocks)
    return [dataclasses.replace(block, strip_in=highest) for block in blocks]


def _columns(group: Group, room_in: float) -> int:
    """Return how many panels of a group stand in a row."""
    panels = len(group.panels)
    fit = max(1, int((room_in - _Y_AXIS_IN + _GAP_IN) / (group.least_in + _GAP_IN)))
    if panels <= fit:
        return panels
    if 0 < group.columns <= fit:
        return group.columns
    return math.ceil(panels / math.ceil(panels / fit))


def _draw_block(page: _Page, block: _Block, top_in: float) -> None:
    group = block.group
    y_in = top_in - line_in(_TITLE_SIZE) / 2
    letter_in = width_in(block.letter, _TITLE_SIZE, bold=True) + 0.07
    left_in = block.left_in - _Y_AXIS_IN + 0.02
    page.text(left_in, y_in, block.letter, _TITLE_SIZE, **bold_face(block.letter))
    page.text(left_in + letter_in, y_in, group.title, _TITLE_SIZE)
    for number, panel in enumerate(group.panels):
        row, column = divmod(number, block.columns)
        panel_left_in = block.left_in + column * (block.panel_in + _GAP_IN)
        panel_top_in = top_in - _title_in() - row * (block.row_in + _GAP_IN) - block.strip_in
        axes = page.axes(panel_left_in, panel_top_in - group.height_in, block.panel_in, group.height_in)
        panel.draw(axes)
        axes.set(xlabel="", ylabel="")
        if column:
            axes.tick_params(axis="y", which="both", labelleft=False, left=False)
        if number + block.columns < len(group.panels):
            axes.tick_params(axis="x", which="both", labelbottom=False)
        _draw_strip(page, block, block.strip_lines[number], panel_left_in, panel_top_in)
    _draw_axis_labels(page, block, top_in)


def _draw_strip(page: _Page, block: _Block, lines: Sequence[str], left_in: float, bottom_in: float) -> None:
    from matplotlib.patches import Rectangle

    if not lines:
        return
    corner = (left_in / page.width_in, bottom_in / page.height_in)
    size = (block.panel_in / page.width_in, (block.strip_in - 0.02) / page.height_in)
    page.figure.add_artist(
        Rectangle(corner, *size, color=BAND, linewidth=0, transform=page.figure.transFigure)
    )
    middle_in = bottom_in + (block.strip_in - 0.02) / 2 + (len(lines) - 1) * line_in(_STRIP_SIZE) / 2
    for number, line in enumerate(lines):
        y_in = middle_in - number * line_in(_STRIP_SIZE)
        page.text(left_in + block.panel_in / 2, y_in, line, _STRIP_SIZE, ha="center")


def _draw_axis_labels(page: _Page, block: _Block, top_in: float) -> None:
    group = block.group
    lowest_in = top_in - _title_in() - block.rows * block.row_in - (block.rows - 1) * _GAP_IN
    bottom_in = top_in - block.height_in
    if group.x_label:
        labels = broken(group.x_label, block.width_in, 8)
        for number, text in enumerate(labels):
            y_in = bottom_in + (len(labels) - number - 0.5) * line_in(8)
            page.text(block.left_in + block.width_in / 2, y_in, text, 8, ha="center")
    middle_in = (top_in - _title_in() + lowest_in) / 2
    length_in = top_in - _title_in() - lowest_in
    lines = broken(group.y_label, length_in + 0.1, 8)
    for number, text in enumerate(lines):
        x_in = block.left_in - _Y_AXIS_IN + 0.08 + number * line_in(8)
        page.text(x_in, middle_in, text, 8, ha="center", rotation=90)
