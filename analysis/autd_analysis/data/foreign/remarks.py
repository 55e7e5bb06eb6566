"""What a reader should know of somebody's table: what was forgiven, taken for something, or not read."""

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path

from autd_analysis.data.checks import alike_words
from autd_analysis.data.design import Design, StudyFactor
from autd_analysis.data.foreign.request import TableRequest, choice_option, columns_option, words_option
from autd_analysis.data.foreign.row import Line
from autd_analysis.data.foreign.words import Levels, are_right_or_wrong, few, spelled
from autd_analysis.data.trial_table import TrialRow
from autd_trials.tables import FOREIGN_MISSING_WORDS, Table, level_text

_SLOW_S = 30.0
"""Nobody's typical answer takes so long: times in ms were taken for s."""


def of_tables(tables: Sequence[Table]) -> Iterator[str]:
    """Yield what was forgiven, with the files in which it was."""
    said: dict[str, list[str]] = defaultdict(list)
    for table in tables:
        for remark in table.remarks:
            said[remark].append(table.path.name)
    for remark, names in said.items():
        yield f"{few(names)}: {remark}"


def from_names(
    paths: Sequence[Path], labels: Sequence[str] | None, columns: Sequence[Mapping[str, str]]
) -> Iterator[str]:
    """Yield whose files were taken for whose."""
    if labels is not None and len(paths) > 1 and not all("participant" in each for each in columns):
        pairs = [f"{label} ({path.name})" for label, path in zip(labels, paths, strict=True)]
        yield (
            f"{len(set(labels))} participants are taken from the files' names, as no column is named: "
            f"{few(pairs)}"
        )


def of_nobody(rows: Sequence[TrialRow]) -> Iterator[str]:
    """Yield participants of whom nothing counts."""
    counted = {row.participant for row in rows if row.used}
    for participant in sorted({row.participant for row in rows} - counted):
        yield (
            f"nothing of sub-{participant} counts; to leave it out: "
            f"{choice_option('--exclude', 'participant', participant)}"
        )


def look_alikes(design: Design) -> Iterator[str]:
    """Yield levels that may be one."""
    for factor in design.factors:
        for words in alike_words(level for level in factor.levels if isinstance(level, str)):
            yield f"levels of {factor.name} that look alike: {words}; are they one?"


def of_levels(
    factors: Sequence[StudyFactor], levels: Mapping[str, Levels], request: TableRequest
) -> Iterator[str]:
    """Yield which levels are numbers of a unit, and which only look like numbers."""
    for factor in factors:
        found = levels[factor.name]
        if found.unit:
            yield f"levels of {factor.name} are read as numbers of {found.unit}"
        if found.remark:
            order = "" if factor.name in request.levels else f", in this order: {spelled(factor.levels)}"
            yield f"levels of {factor.name} are taken as words, as {found.remark}{order}"


def empty(lines: Sequence[Line]) -> Iterator[str]:
    """Yield how many lines are no trials."""
    if lines:
        yield (
            f"{len(lines)} line(s) with neither an answer nor a level of any factor skipped, the first is "
            f"{Path(lines[0].where).name}"
        )


def of_answers(
    understood: Mapping[str, bool | None],
    request: TableRequest,
    columns: Sequence[Mapping[str, str]],
) -> Iterator[str]:
    """Yield what answers were taken for."""
    if request.yes:
        felt = [word for word, meaning in understood.items() if meaning]
        others = [word for word, meaning in understood.items() if meaning is False]
        shown = [word if word.lower() not in FOREIGN_MISSING_WORDS else "no answer" for word in others]
        yield f"answers taken as felt: {few(felt)}; as not felt: {few(list(dict.fromkeys(shown))) or 'none'}"
    elif False not in understood.values() and None in understood.values():
        felt = [word for word, meaning in understood.items() if meaning]
        yield f"all answers mean felt; if none means not felt: {words_option('--yes', felt)}"
    right_or_wrong = are_right_or_wrong(columns[0].get("response", columns[0].get("felt", "")), understood)
    if right_or_wrong and not request.guess_known:
        yield (
            "answers seem to be right or wrong: whoever guesses between two alternatives is right in half of "
            "all trials. If so, say it: --guess 0.5 (1/m with m alternatives)"
        )


def of_catch_trials(
    rows: Sequence[TrialRow],
    lines: Sequence[Line],
    factors: Sequence[StudyFactor],
    levels: Mapping[str, Levels],
) -> Iterator[str]:
    """Yield what catch trials lack of levels, or have alone; or what may be catch trials."""
    catch = [(row, line) for row, line in zip(rows, lines, strict=True) if row.trial_type == "catch"]
    for factor in factors:
        found = levels[factor.name].of
        own = {level for _, line in catch if (level := found[line.cells[factor.name]]) is not None}
        others = [level for level in levels[factor.name].ordered if level not in factor.levels]
        if only := [level for level in others if level in own]:
            yield f"only catch trials have {factor.name} {spelled(only)}, so it is no condition"
        if rest := [level for level in others if level not in own]:
            yield f"no answered stimulus has {factor.name} {spelled(rest)}, so it is no condition"
        without = sum(row.levels[factor.name] is None for row, _ in catch)
        if 0 < without < len(catch):
            yield (
                f"{without} of {len(catch)} catch trials have no level of {factor.name}: false alarms of all "
                "its levels are taken together"
            )
        sizes = [level for level in factor.levels if isinstance(level, float)]
        if not catch and len(sizes) > 2 and min(sizes) == 0:
            yield (
                f"if nothing was presented where {factor.name} is 0, these are catch trials: "
                f"{choice_option('--catch', factor.name, '0')}"
            )


def slow(rows: Sequence[TrialRow], request: TableRequest) -> Iterator[str]:
    """Yield that response times may be in ms."""
    times = sorted(row.response_time_s for row in rows if row.response_time_s is not None)
    if times and "response_time" in request.columns and times[len(times) // 2] > _SLOW_S:
        columns = {
            "response_time_ms" if ours == "response_time" else ours: theirs
            for ours, theirs in request.columns.items()
        }
        yield (
            f"half of the response times are over {level_text(float(f'{times[len(times) // 2]:.3g}'))} s; if "
            f"they are in ms: {columns_option(columns)}"
        )


def not_read(
    tables: Sequence[Table], columns: Sequence[Mapping[str, str]], request: TableRequest
) -> Iterator[str]:
    """Yield which columns were not looked at."""
    looked_at = {name for name, _ in (*request.catch, *request.exclude)} | set(request.ignore)
    others = dict.fromkeys(
        column
        for table, its_columns in zip(tables, columns, strict=True)
        for column in table.header
        if column not in its_columns.values() and column not in looked_at
    )
    if others:
        yield f"columns of the table that were not read: {', '.join(others)}"


def mixed_origins(simulated: Collection[bool]) -> Iterator[str]:
    """Yield that some lines are of simulated participants."""
    if any(simulated) and not all(simulated):
        yield (
            f"{sum(simulated)} of {len(simulated)} lines are of simulated participants and the others are "
            "not: results of a mixture are neither"
        )
