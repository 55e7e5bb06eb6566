"""Methods and results as paragraphs for a manuscript, every number from the results."""

from collections.abc import Iterator, Mapping, Sequence

from autd_analysis.comparisons import ComparisonResult
from autd_analysis.design import Condition, StudyFactor
from autd_analysis.intervals import Interval
from autd_analysis.rates import ConditionRate
from autd_analysis.report.recorded_methods import recorded_methods
from autd_analysis.study import Results
from autd_analysis.threshold_words import comparison_words, group_words, method_sentences
from autd_analysis.timing_words import timing_sentences
from autd_analysis.wording import (
    Labels,
    direction,
    format_interval,
    format_number,
    format_rate,
    p_equals,
    study_labels,
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
    "are means over participants, each participant counting the same, with Student's 95% t interval over "
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


def methods_text(results: Results, software: Mapping[str, str]) -> tuple[tuple[str, str], ...]:
    """Return headings and paragraphs for a manuscript's methods: who, what, how it was run and analysed.

    Parameters
    ----------
    results
        The study's results.
    software
        Versions of what was used, by name.
    """
    versions = ", ".join(f"{name} {version}" for name, version in software.items())
    labels = study_labels(results.trials.design)
    method = results.trials.design.method
    how = (
        (
            _RATES,
            _DETECTABILITY if results.detectability else _NO_CATCH_TRIALS,
            *_tests_made(results.comparisons, labels),
        )
        if method is None
        else (method_sentences(method),)
    )
    who = (*_people(results), *_design(results.trials.design.factors, labels), *_trials(results))
    return (
        ("Participants and design", " ".join(who)),
        *recorded_methods(results),
        ("Statistics", " ".join((*how, f"Analyses were made with {versions}."))),
    )


def results_text(results: Results) -> tuple[str, ...]:
    """Return paragraphs for a manuscript's results: rates, false alarms, planned comparisons, timing.

    Parameters
    ----------
    results
        The study's results.
    """
    labels = study_labels(results.trials.design)
    found = (
        (" ".join(_thresholds(results, labels)), " ".join(_false_alarms(results, labels)))
        if results.thresholds
        else (
            " ".join((*_rates(results.rates, labels), *_false_alarms(results, labels))),
            " ".join(_comparison(result, labels) for result in results.comparisons),
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


def _design(factors: Sequence[StudyFactor], labels: Labels) -> Iterator[str]:
    varied = [_factor(factor, labels) for factor in factors if len(factor.levels) > 1]
    held = [_factor(factor, labels) for factor in factors if len(factor.levels) == 1]
    if varied:
        yield f"{_upper_first(_and(varied))} {_was(len(varied))} varied within participants."
    if held:
        yield f"{_upper_first(_and(held))} {_was(len(held))} the same in all trials."
    if not factors:
        yield "All stimuli were alike."


def _factor(factor: StudyFactor, labels: Labels) -> str:
    """Return a factor with its levels, as in ``modulation frequency (25, 50, 100 Hz)``."""
    *others, last = factor.levels
    levels = [*(labels.level(factor.name, level) for level in others), labels.quantity(factor.name, last)]
    return f"{labels.words(factor.name)} ({', '.join(levels)})"


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


def _tests_made(comparisons: Sequence[ComparisonResult], labels: Labels) -> Iterator[str]:
    if not comparisons:
        yield "No comparison was planned."
        return
    places: dict[str, list[str]] = {}
    for result in comparisons:
        difference = labels.difference(result.factor, result.first, result.second)
        places.setdefault(difference, []).append(_where(result.at, labels) or "overall")
    what = _and([f"{difference} {_and(where)}" for difference, where in places.items()])
    yield (
        f"{_upper_first(_counted(len(comparisons), 'comparison'))} within participants "
        f"{_was(len(comparisons))} planned: {what}."
    )
    one = comparisons[0]
    numbers = {_SIGN_FLIP: one.sign_flip_tests, _PAIRED_T: one.paired_t_tests, _MIXED: one.mixed_model_tests}
    made = [f"{test} (adjusted over {number})" for test, number in numbers.items() if number]
    if made:
        yield (
            f"Participants' differences of rates were tested two-sided by {_and(made)}; p values were "
            "adjusted by Holm's method for each kind of test."
        )
    else:
        yield "None of them could be tested."


def _rates(rates: Sequence[ConditionRate], labels: Labels) -> Iterator[str]:
    known = [rate for rate in rates if rate.mean is not None]
    if not known:
        yield "No stimulus was answered, so that there is no detection rate."
        return
    parts = [f"{_rate(rate)} {_where(rate.condition, labels)}".rstrip() for rate in known]
    yield (
        "The mean detection rate over participants, with its 95% t interval where it has one, was "
        f"{_and(parts)}."
    )


def _thresholds(results: Results, labels: Labels) -> Iterator[str]:
    for group in results.group_thresholds:
        where = _where(group.condition, labels) or "overall"
        yield f"The geometric mean threshold {where} was {group_words(group)}."
    for found in results.threshold_comparisons:
        yield f"Difference of thresholds, {comparison_words(found, labels)}."


def _false_alarms(results: Results, labels: Labels) -> Iterator[str]:
    if results.false_alarms is None:
        yield "There were no catch trials, so that the false-alarm rate is not known."
        return
    parts = [
        f"{_rate(rate)} {_where(rate.condition, labels) or 'overall'}"
        for rate in results.false_alarms
        if rate.mean is not None
    ]
    yield f"The mean false-alarm rate was {_and(parts)}."


def _comparison(result: ComparisonResult, labels: Labels) -> str:
    where = _where(result.at, labels)
    opening = f"{_upper_first(where)}, " if where else "Overall, "
    first, second = (labels.stated(result.factor, level) for level in (result.first, result.second))
    if result.mean is None:
        return f"{opening}{first} and {second} could not be compared: no participant has both rates."
    change = (
        f"the detection rate was {format_rate(abs(result.mean))} "
        f"{'higher' if result.mean > 0 else 'lower'} with {first} than with {second}"
        if direction(result.mean)
        else f"the mean detection rate was the same with {first} as with {second}"
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
            f"paired t test t({test.df}) = {format_number(test.t)}, {p_equals(test.p)}, Holm-adjusted "
            f"{p_equals(result.paired_t_holm)}, dz = {format_number(test.dz)}"
        )
    if result.mixed_model:
        model = result.mixed_model
        yield (
            f"mixed model {format_number(model.logits)} logits, "
            f"{_CHI2}(1) = {format_number(model.statistic)}, {p_equals(model.p)}, "
            f"Holm-adjusted {p_equals(result.mixed_model_holm)}"
        )


def _where(condition: Condition, labels: Labels) -> str:
    """Return a condition in words, as in ``at modulation frequency 25 Hz and clothing inner``."""
    parts = [f"{labels.words(name)} {labels.quantity(name, level)}" for name, level in condition]
    return f"at {_and(parts)}" if parts else ""


def _rate(rate: ConditionRate) -> str:
    interval = f" {format_interval(rate.interval)}" if rate.interval else ""
    return f"{format_rate(rate.mean)}{interval}"


def _interval(interval: Interval | None) -> str:
    return f"95% CI {format_interval(interval)}, " if interval else ""


def _counted(number: int, thing: str) -> str:
    words = _NUMBERS[number] if number < len(_NUMBERS) else str(number)
    return f"{words} {thing}{'s' * (number != 1)}"


def _was(number: int) -> str:
    return "was" if number == 1 else "were"


def _and(parts: Sequence[str]) -> str:
    return f"{', '.join(parts[:-1])} and {parts[-1]}" if len(parts) > 1 else parts[0]


def _upper_first(text: str) -> str:
    return text[:1].upper() + text[1:]
