"""The factors of somebody's table: their levels, those of stimuli, in order; and what is compared of them."""

from collections.abc import Mapping, Sequence

from autd_analysis.data.design import StudyFactor
from autd_analysis.data.foreign.columns import factor_names
from autd_analysis.data.foreign.request import TableRequest, columns_option, comparison_option, levels_option
from autd_analysis.data.foreign.row import Line
from autd_analysis.data.foreign.words import Levels, plain_words, spelled
from autd_trials.errors import UsageError
from autd_trials.protocol.schema import Comparison, Level
from autd_trials.tables import level_text

_MOST_LEVELS = 50
_MOST_CONDITIONS = 2_000


def refuse_strange_factors(request: TableRequest) -> None:
    """Refuse what names no factor, before any file is read."""
    names = factor_names(request)
    stray = [name for name in request.levels if name not in names]
    if stray and names:
        raise UsageError(
            f"--levels names {', '.join(stray)}, which is no factor",
            where="--levels",
            do=f"name a factor: {levels_option(names[0], request.levels[stray[0]])}",
        )
    for comparison in request.comparisons:
        for name in filter(None, (comparison.factor, comparison.at_each)):
            if name not in names and names:
                free = [each for each in names if each not in (comparison.factor, comparison.at_each)]
                mended = (
                    {"at_each": free[0] if free else None}
                    if name == comparison.at_each and name != comparison.factor
                    else {"factor": (free or names)[0]}
                )
                raise UsageError(
                    f"{name} is compared but no factor",
                    where="--compare",
                    do=f"name {', '.join(names)}, as in "
                    f"{comparison_option(comparison.model_copy(update=mended))}",
                )
        if comparison.at_each == comparison.factor:
            without = comparison.model_copy(update={"at_each": None})
            raise UsageError(
                f"{comparison.factor} is compared at each of its own levels",
                where="--compare",
                do=f"name another factor after @, or none: {comparison_option(without)}",
            )


def study_factor(
    name: str,
    counted: Sequence[Line],
    catch: Sequence[Line],
    levels: Levels,
    request: TableRequest,
    where: str,
) -> StudyFactor:
    """Return a factor with the levels that stimuli have which were answered.

    Parameters
    ----------
    name
        Its name.
    counted, catch
        The lines of answered stimuli, and those of catch trials.
    levels
        What the words in its column are.
    request, where
        What was asked for, and of which table.
    """
    present = {levels.of[line.cells[name]] for line in counted}
    found = tuple(level for level in levels.ordered if level in present)
    if name in request.levels:
        found = _in_order(name, found, levels, request.levels[name], where)
    if len(found) > _MOST_LEVELS:
        rest = {ours: theirs for ours, theirs in request.columns.items() if ours != name}
        others = any(each in rest for each in factor_names(request))
        raise UsageError(
            f"{name} has {len(found)} levels: {spelled(found)}",
            where=where,
            do=f"is it a factor? Without it: {columns_option(rest)}"
            if others
            else f"round them in the table, to at most {_MOST_LEVELS}",
        )
    with_level = sum(levels.of[line.cells[name]] in found for line in catch)
    # What catch trials have a level of they share with the stimuli around them, as clothes do.
    return StudyFactor(name, found, {}, within_block=not catch or with_level < len(catch))


def refuse_too_many(factors: Sequence[StudyFactor], where: str, request: TableRequest) -> None:
    """Raise UsageError if the factors make more conditions than anybody compares."""
    conditions = 1
    for factor in factors:
        conditions *= len(factor.levels)
    if conditions > _MOST_CONDITIONS:
        most = max(factors, key=lambda factor: len(factor.levels))
        rest = {ours: theirs for ours, theirs in request.columns.items() if ours != most.name}
        raise UsageError(
            f"the factors make {conditions:,} conditions",
            where=where,
            do=f"leave one out: {columns_option(rest)}",
        )


def checked_comparisons(
    where: str,
    comparisons: Sequence[Comparison],
    factors: Sequence[StudyFactor],
    levels: Mapping[str, Levels],
) -> tuple[Comparison, ...]:
    """Return the comparisons with their levels as the factors have them."""
    known = {factor.name: factor for factor in factors}
    checked: list[Comparison] = []
    for comparison in comparisons:
        factor = known[comparison.factor]
        named = [
            levels[factor.name].level(plain_words(level_text(level)))
            for level in (comparison.first, comparison.second)
        ]
        found = [level if level in factor.levels else None for level in named]
        if None in found or found[0] == found[1]:
            several = len(factor.levels) > 1
            two = comparison.model_copy(
                update=dict(zip(("first", "second"), factor.levels[:2], strict=False))
            )
            raise UsageError(
                f"{level_text(comparison.first)} and {level_text(comparison.second)} are not two levels of "
                f"{factor.name}, which are {spelled(factor.levels)}",
                where="--compare",
                do=f"compare two of them, as in {comparison_option(two)}"
                if several
                else f"there is one level of {factor.name} only: leave --compare out",
            )
        update = {"first": found[0], "second": found[1]}
        mirrored = {"first": found[1], "second": found[0]}
        if (
            comparison.model_copy(update=update) in checked
            or comparison.model_copy(update=mirrored) in checked
        ):
            raise UsageError("--compare asks for the same comparison twice", where=where, do="ask once")
        checked.append(comparison.model_copy(update=update))
    return tuple(checked)


def _in_order(
    name: str, found: Sequence[Level], levels: Levels, asked: Sequence[str], where: str
) -> tuple[Level, ...]:
    """Return a factor's levels in the order that was asked for; names of levels that nobody has are kept."""
    wanted: list[Level] = []
    for word in asked:
        level = levels.level(plain_words(word))
        if level is None and not all(isinstance(each, float) for each in found):
            level = plain_words(word)
        if level is None:
            raise UsageError(
                f"--levels names {word}, which is no level of {name}",
                where=where,
                do=f"name its levels: {levels_option(name, map(level_text, found))}",
            )
        wanted.append(level)
    strange = [level for level in found if level not in wanted]
    if strange:
        have = [level for level in wanted if level in found]
        raise UsageError(
            f"{name} has levels that --levels does not name: {spelled(strange)}",
            where=where,
            do=f"name all: {levels_option(name, map(level_text, [*have, *strange]))}",
        )
    # A level that only catch trials have is no condition, though it be named.
    others = set(levels.of.values()) - set(found)
    return tuple(dict.fromkeys(level for level in wanted if level not in others))
