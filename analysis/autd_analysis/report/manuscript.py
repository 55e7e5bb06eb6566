"""Methods and results as paragraphs for a manuscript, every number from the results."""

from collections.abc import Iterator, Sequence

from autd_analysis.comparisons import ComparisonResult
from autd_analysis.design import Condition, StudyFactor
from autd_analysis.intervals import Interval
from autd_analysis.rates import ConditionRate
from autd_analysis.study import Results
from autd_analysis.threshold_words import comparison_words, group_words, method_sentences
from autd_analysis.timing_words import timing_sentences
from autd_analysis.wording import (
    compared_label,
    difference_label,
    factor_label,
    format_interval,
    format_rate,
    level_label,
    p_equals,
)

_CHI2 = "\N{GREEK SMALL LETTER CHI}\N{SUPERSCRIPT TWO}"
_NUMBERS = [
    "no",
    "one",
    "two",
    "three",
    "four",
    "five",
    "six",
    "seven",
    "eight",
    "nine",
    "ten",
    "eleven",
    "twelve",
]
_RATES = (
    "A participant's detection rate is the share of trials with a stimulus that were answered as felt. Rates "
    "are means over participants, each participant counting the same, with Student's 95 % t interval over "
    "participants."
)
_DETECTABILITY = (
    "The false-alarm rate is the share of catch trials that were answered as felt, and d' is z(hit rate) "
    "minus z(false-alarm rate) with the log-linear correction (1/2 added to counts, 1 to numbers of trials)."
)
_SIGN_FLIP = "an exact sign-flip test"
_PAIRED_T = "a paired t test"
_MIXED = (
    "the likelihood-ratio test of a logistic mixed model with random intercepts and random slopes of the "
    "compared factor over participants"
)
_NO_CATCH_TRIALS = "Without catch trials the false-alarm rate and d' are undefined."


def methods_text(results: Results, software: dict[str, str]) -> tuple[str, ...]:
    """Return paragraphs for a manuscript's methods: who, what, and how it was analysed.

    Parameters
    ----------
    results
        The study's results.
    software
        Versions of what was used, by name.
    """
    versions = ", ".join(f"{name} {version}" for name, version in software.items())
    method = results.trials.design.method
    how = (
        (
            " ".join((_RATES, _DETECTABILITY if results.detectability else _NO_CATCH_TRIALS)),
            " ".join(_tests_made(results.comparisons)),
        )
        if method is None
        else (method_sentences(method),)
    )
    return (
        " ".join((*_people(results), *_design(results.trials.design.factors), *_trials(results))),
        *how,
        f"Analyses were made with {versions}.",
    )


def results_text(results: Results) -> tuple[str, ...]:
    """Return paragraphs for a manuscript's results: rates, false alarms, planned comparisons, timing.

    Parameters
    ----------
    results
        The study's results.
    """
    found = (
        (" ".join(_thresholds(results)), " ".join(_false_alarms(results)))
        if results.thresholds
        else (
            " ".join((*_rates(results.rates), *_false_alarms(results))),
            " ".join(map(_comparison, results.comparisons)),
        )
    )
    paragraphs = (
        *found,
        " ".join(timing_sentences(results.trials)),
    )
    return tuple(paragraph for paragraph in paragraphs if paragraph)


def _people(results: Results) -> Iterator[str]:
    trials = results.trials
    kind = "simulated participant" if results.simulated else "participant"
    people = _upper_first(_counted(len(trials.participants), kind))
    yield f"{people} took part in {_counted(trials.sessions, 'session')}."
    if results.simulated:
        yield "The participants were simulated by a program; these are no data about people."


def _design(factors: Sequence[StudyFactor]) -> Iterator[str]:
    varied = [_factor(factor) for factor in factors if len(factor.levels) > 1]
    held = [_factor(factor) for factor in factors if len(factor.levels) == 1]
    if varied:
        yield f"{_upper_first(_and(varied))} {_was(len(varied))} varied within participants."
    if held:
        yield f"{_upper_first(_and(held))} {_was(len(held))} the same in all trials."
    if not factors:
        yield "All stimuli were alike."


def _factor(factor: StudyFactor) -> str:
    """Return a factor with its levels, as in ``modulation frequency (25, 50, 100 Hz)``."""
    words, unit = _words_and_unit(factor.name)
    return f"{words} ({', '.join(map(level_label, factor.levels))}{unit})"


def _trials(results: Results) -> Iterator[str]:
    table = results.trials.table
    used = table["used"]
    counted = int(used.sum())
    catch = int((used & (table["trial_type"] == "catch")).sum())
    per_cell = sorted({rate.n for rate in results.participant_rates})
    each = str(per_cell[0]) if len(per_cell) == 1 else f"{per_cell[0]} to {per_cell[-1]}"
    stimuli = f"{each} of each participant in each condition"
    yield (
        f"{counted} trials were analysed: {counted - catch} with a stimulus, {stimuli}, and {catch} catch "
        "trials without one."
        if catch
        else f"{counted} trials were analysed, {stimuli}; there were no catch trials."
    )
    uncounted = int((~used).sum())
    if uncounted:
        yield f"{_upper_first(_counted(uncounted, 'attempt'))} at a trial {_was(uncounted)} not counted."


def _tests_made(comparisons: Sequence[ComparisonResult]) -> Iterator[str]:
    if not comparisons:
        yield "No comparison was planned."
        return
    places: dict[str, list[str]] = {}
    for result in comparisons:
        places.setdefault(difference_label(result), []).append(_where(result.at) or "overall")
    what = _and([f"{difference} {_and(where)}" for difference, where in places.items()])
    yield (
        f"{_upper_first(_counted(len(comparisons), 'comparison'))} within participants "
        f"{_was(len(comparisons))} planned: {what}."
    )
    made = [
        test
        for test, its in (
            (_SIGN_FLIP, [result.sign_flip for result in comparisons]),
            (_PAIRED_T, [result.paired_t for result in comparisons]),
            (_MIXED, [result.mixed_model for result in comparisons]),
        )
        if any(its)
    ]
    if made:
        yield (
            f"Participants' differences of rates were tested two-sided by {_and(made)}; p values were "
            f"adjusted by Holm's method over {_counted(comparisons[0].family, 'planned test')} of each kind."
        )
    else:
        yield "None of them could be tested."


def _rates(rates: Sequence[ConditionRate]) -> Iterator[str]:
    known = [rate for rate in rates if rate.mean is not None]
    if not known:
        yield "No stimulus was answered, so that there is no detection rate."
        return
    parts = [f"{_rate(rate)} {_where(rate.condition)}".rstrip() for rate in known]
    yield (
        "The mean detection rate over participants, with its 95 % t interval where it has one, was "
        f"{_and(parts)}."
    )


def _thresholds(results: Results) -> Iterator[str]:
    for group in results.group_thresholds:
        where = _where(group.condition) or "overall"
        yield f"The geometric mean threshold {where} was {group_words(group)}."
    for found in results.threshold_comparisons:
        yield f"Difference of thresholds, {comparison_words(found)}."


def _false_alarms(results: Results) -> Iterator[str]:
    if results.false_alarms is None:
        yield "There were no catch trials, so that the false-alarm rate is not known."
        return
    parts = [
        f"{_rate(rate)} {_where(rate.condition) or 'overall'}"
        for rate in results.false_alarms
        if rate.mean is not None
    ]
    yield f"The mean false-alarm rate was {_and(parts)}."


def _comparison(result: ComparisonResult) -> str:
    where = _where(result.at)
    opening = f"{_upper_first(where)}, " if where else "Overall, "
    first, second = (compared_label(result, level) for level in (result.first, result.second))
    if result.mean is None:
        return f"{opening}{first} and {second} could not be compared: no participant has both rates."
    change = (
        f"the mean detection rate was the same with {first} as with {second}"
        if result.mean == 0
        else f"the detection rate was {format_rate(abs(result.mean))} "
        f"{'higher' if result.mean > 0 else 'lower'} with {first} than with {second}"
    )
    facts = [f"{_interval(result.interval)}n = {result.participants}", *_tests(result)]
    notes = "".join(f" {_upper_first(note)}." for note in result.notes)
    return f"{opening}{change} ({'; '.join(facts)}).{notes}"


def _tests(result: ComparisonResult) -> Iterator[str]:
    if result.sign_flip:
        yield (
            f"exact sign-flip test {p_equals(result.sign_flip.p)}, Holm-adjusted "
            f"{p_equals(result.sign_flip_holm)}, least possible {p_equals(result.sign_flip.floor)}"
        )
    if result.paired_t:
        test = result.paired_t
        yield (
            f"paired t test t({test.df}) = {format_rate(test.t)}, {p_equals(test.p)}, Holm-adjusted "
            f"{p_equals(result.paired_t_holm)}, dz = {format_rate(test.dz)}"
        )
    if result.mixed_model:
        model = result.mixed_model
        yield (
            f"mixed model {format_rate(model.logits)} logits, {_CHI2}(1) = {format_rate(model.statistic)}, "
            f"{p_equals(model.p)}, Holm-adjusted {p_equals(result.mixed_model_holm)}"
        )


def _where(condition: Condition) -> str:
    """Return a condition in words, as in ``at modulation frequency 25 Hz and clothing inner``."""
    return f"at {_and([_level(name, level) for name, level in condition])}" if condition else ""


def _level(name: str, level: float | str) -> str:
    words, unit = _words_and_unit(name)
    return f"{words} {level_label(level)}{unit}"


def _words_and_unit(name: str) -> tuple[str, str]:
    """Return a factor's name in a sentence and, with a blank before it, its unit; "" without one."""
    words, _, unit = factor_label(name).partition(" (")
    return _lower_first(words), f" {unit.removesuffix(')')}" if unit else ""


def _rate(rate: ConditionRate) -> str:
    interval = f" {format_interval(rate.interval)}" if rate.interval else ""
    return f"{format_rate(rate.mean)}{interval}"


def _interval(interval: Interval | None) -> str:
    return f"95 % t interval {format_interval(interval)}, " if interval else ""


def _counted(number: int, thing: str) -> str:
    words = _NUMBERS[number] if number < len(_NUMBERS) else str(number)
    return f"{words} {thing}{'s' * (number != 1)}"


def _was(number: int) -> str:
    return "was" if number == 1 else "were"


def _and(parts: Sequence[str]) -> str:
    return f"{', '.join(parts[:-1])} and {parts[-1]}" if len(parts) > 1 else parts[0]


def _upper_first(text: str) -> str:
    return text[:1].upper() + text[1:]


def _lower_first(text: str) -> str:
    return text[:1].lower() + text[1:]
