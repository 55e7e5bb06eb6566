"""Do answers depend on when they were given? Fatigue, practice, sessions, the answer before, order of blocks.

Within a participant and condition, answers could have come in any order if time did not matter. So the
first four are tested by shuffling the answers within participant and condition, which takes nothing for
granted of how people or conditions differ. The order of the blocks is tested between those who began with
one and those who began with the other (Hills and Armitage, 1979, Br. J. Clin. Pharmacol. 8, 7-20). These
are checks, not planned tests: with several of them one below .05 is no wonder, and none above it shows that
there is no effect.
"""

import math
import statistics
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from autd_analysis.basics.intervals import CONFIDENCE, Interval, t_interval
from autd_analysis.data.design import Design
from autd_analysis.data.trials import Trials

if TYPE_CHECKING:
    import pandas as pd

SHUFFLES = 1999
_SEED = 1
_NO_ORDER = "the table has no column of trials, so their order is not known"
_NO_SPREAD = 1e-12

Array = NDArray[np.float64]


@dataclass(frozen=True)
class OrderEffect:
    """One way in which answers may depend on their order.

    Attributes
    ----------
    name
        Which effect.
    about
        What the estimate is.
    estimate, interval
        Mean over participants and its t interval (a difference between two groups for the order of blocks).
    p
        Two-sided; None where it cannot be tested.
    participants
        Number of participants whose responses determine it.
    method
        How p was found.
    note
        Why there is nothing to test, if so.
    """

    name: str
    about: str
    estimate: float | None
    interval: Interval | None
    p: float | None
    participants: int
    method: str
    note: str | None = None


def order_effects(trials: Trials) -> tuple[OrderEffect, ...]:
    """Check for effects of order.

    Parameters
    ----------
    trials
        The study's trials; counted stimuli are used.

    Returns
    -------
    tuple of OrderEffect
        Always the same effects; those that cannot be tested say why.
    """
    answers = _Answers(trials)
    changes = (_change(answers, name, about, x) for name, about, x in answers.times())
    effects = (*changes, _serial_dependence(answers), *_block_order(trials))
    if trials.ordered:
        return effects
    return tuple(_nothing(effect.name, effect.about, _NO_ORDER) for effect in effects)


class _Answers:
    """The counted stimuli in the order in which they came, with their cell and residual."""

    def __init__(self, trials: Trials) -> None:
        table = trials.table
        kept = table[table["used"] & (table["trial_type"] == "stimulus")]
        kept = kept.sort_values(["participant", "session", "trial"], kind="stable").reset_index(drop=True)
        factors = [factor.name for factor in trials.design.factors]
        self.felt: Array = kept["felt"].to_numpy(dtype=float)
        self.participant = _codes(kept, ["participant"])
        self.cell = _codes(kept, ["participant", *factors])
        self.block = _codes(kept, ["participant", "session", "block"])
        self.session = _codes(kept, ["participant", "session"])
        self.trial: Array = kept["trial"].to_numpy(dtype=float)
        self.several_sessions = _sessions_of(kept)
        means = np.bincount(self.cell, self.felt) / np.maximum(np.bincount(self.cell), 1)
        self.residual: Array = self.felt - means[self.cell]

    def times(self) -> Iterator[tuple[str, str, Array]]:
        """Yield each scale of time: its name, what a slope on it is, and every trial's time on it."""
        yield (
            "course of the session",
            "change of the rate from the first to the last trial of a session",
            _unit_scale(self.trial, self.session),
        )
        yield (
            "course of the block",
            "change of the rate from the first to the last trial of a block",
            _unit_scale(self.trial, self.block),
        )
        yield "session", "change of the rate from one session to the next", self.several_sessions

    @cached_property
    def shuffled(self) -> Array:
        """Residuals shuffled within participant and condition, shape (shuffles, trials)."""
        generator = np.random.default_rng(_SEED)
        by_cell = np.argsort(self.cell, kind="stable")
        keys = self.cell[by_cell] + generator.random((SHUFFLES, len(self.cell)))
        result = np.empty(keys.shape)
        result[:, by_cell] = self.residual[by_cell][np.argsort(keys, axis=1)]
        return result


def _change(answers: _Answers, name: str, about: str, times: Array) -> OrderEffect:
    """Return the mean over participants of the slope of answers on time within conditions."""
    counts = np.maximum(np.bincount(answers.cell), 1)
    centred = times - (np.bincount(answers.cell, times) / counts)[answers.cell]
    spread = np.bincount(answers.participant, centred**2)
    weights = centred / np.where(spread > 0, spread, 1)[answers.participant]
    slopes: Array = np.bincount(answers.participant, weights * answers.residual).astype(float)[spread > 0]
    if len(slopes) == 0:
        return _nothing(name, about, "time does not vary within a condition")
    shuffled = answers.shuffled @ weights
    return _shuffle_test(name, about, slopes, shuffled)


def _serial_dependence(answers: _Answers) -> OrderEffect:
    name = "answer before"
    about = "correlation of an answer with the one before in its block, less that of shuffled answers"
    follows = np.flatnonzero(answers.block[1:] == answers.block[:-1]) + 1
    spread = np.bincount(answers.participant, answers.residual**2)
    able = np.isin(np.arange(len(spread)), answers.participant[follows]) & (spread > 0)
    if not able.any():
        return _nothing(name, about, "no participant answers differently within a condition")
    weights = np.where(able, 1 / np.where(able, spread, 1), 0)[answers.participant[follows]]

    def products(residuals: Array) -> Array:
        found: Array = residuals[..., follows] * residuals[..., follows - 1] * weights
        return found

    of_participants = np.bincount(answers.participant[follows], products(answers.residual), len(spread))
    correlations: Array = of_participants.astype(float)[able]
    shuffled = products(answers.shuffled).sum(axis=1)
    by_chance = shuffled.mean()  # not zero: answers of a condition share their mean
    return _shuffle_test(name, about, correlations - by_chance / len(correlations), shuffled - by_chance)


def _shuffle_test(name: str, about: str, values: Array, shuffled_sums: Array) -> OrderEffect:
    """Return the effect whose sum over participants is compared with those of shuffled answers."""
    as_far = np.abs(shuffled_sums) >= abs(values.sum()) - 1e-9
    return OrderEffect(
        name=name,
        about=about,
        estimate=float(values.mean()),
        interval=t_interval([float(value) for value in values]),
        p=(1 + int(as_far.sum())) / (1 + SHUFFLES),
        participants=len(values),
        method=f"{SHUFFLES} shuffles of answers within participant and condition",
    )


def _block_order(trials: Trials) -> Iterator[OrderEffect]:
    """Yield period and carry-over, where each participant has one block of each of two kinds."""
    about = {
        "order of blocks": "rate in the first minus rate in the second block, whatever was worn",
        "carry-over": "sum of both blocks' rates: began with the first level minus began with the second",
    }
    sums, note = _two_blocks(trials.table, trials.design)
    if note:
        yield from (_nothing(name, what, note) for name, what in about.items())
        return
    differences = {began: [first - second for first, second in rates] for began, rates in sums.items()}
    totals = {began: [first + second for first, second in rates] for began, rates in sums.items()}
    # (first level - second level) differs between the orders by twice the effect of the period
    yield _between_orders("order of blocks", about["order of blocks"], differences, scale=0.5)
    yield _between_orders("carry-over", about["carry-over"], totals, scale=1.0)


def _two_blocks(
    table: "pd.DataFrame", design: Design
) -> tuple[Mapping[bool, list[tuple[float, float]]], str | None]:
    """Return rates at both levels by whether the first level came first; or why there are none."""
    between = design.between_blocks
    nothing: dict[bool, list[tuple[float, float]]] = {True: [], False: []}
    if len(between) != 1 or len(between[0].levels) != 2:
        return nothing, "needs one factor between blocks, with two levels"
    name, levels = between[0].name, between[0].levels
    kept = table[table["used"] & (table["trial_type"] == "stimulus")]
    for _, person in kept.groupby("participant"):
        blocks = person.groupby(["session", "block"])
        if len(blocks) != 2 or set(person[name]) != set(levels):
            continue
        rates = person.groupby(name)["felt"].mean()
        came = person.assign(session=_session_order(person["session"])).sort_values(["session", "block"])
        first_came_first = came[name].iloc[0] == levels[0]
        nothing[bool(first_came_first)].append((float(rates[levels[0]]), float(rates[levels[1]])))
    if min(map(len, nothing.values())) < 2:
        return nothing, "fewer than two participants with two blocks in one of the orders"
    return nothing, None


def _between_orders(name: str, about: str, groups: Mapping[bool, list[float]], scale: float) -> OrderEffect:
    """Compare those who began with the first level with the others by Welch's t test."""
    from scipy.special import stdtr, stdtrit

    one, other = groups[True], groups[False]
    people, method = len(one) + len(other), "Welch's t test between the orders"
    difference = statistics.fmean(one) - statistics.fmean(other)
    parts = [statistics.variance(group) / len(group) for group in (one, other)]
    if sum(parts) < _NO_SPREAD:
        note = "no spread within the orders"
        return OrderEffect(name, about, scale * difference, None, None, people, method, note)
    error = math.sqrt(sum(parts))
    df = sum(parts) ** 2 / (parts[0] ** 2 / (len(one) - 1) + parts[1] ** 2 / (len(other) - 1))
    half_width = float(stdtrit(df, (1 + CONFIDENCE) / 2)) * error
    return OrderEffect(
        name=name,
        about=about,
        estimate=scale * difference,
        interval=Interval(scale * (difference - half_width), scale * (difference + half_width)),
        p=2 * float(stdtr(df, -abs(difference / error))),
        participants=people,
        method=method,
    )


def _nothing(name: str, about: str, note: str) -> OrderEffect:
    return OrderEffect(name, about, None, None, None, 0, "not testable", note)


def _codes(table: "pd.DataFrame", columns: list[str]) -> NDArray[np.intp]:
    return np.asarray(table.groupby(columns, dropna=False, sort=True).ngroup(), dtype=np.intp)


def _sessions_of(table: "pd.DataFrame") -> Array:
    """Return the number of each trial's session among its participant's, from 0."""
    ranks = _session_order(table["session"]).groupby(table["participant"]).rank(method="dense")
    return np.asarray(ranks.to_numpy(dtype=float) - 1, dtype=float)


def _session_order(sessions: "pd.Series[str]") -> "pd.Series[int]":
    """Return sessions' places: numbers by size, words after them by the alphabet."""
    labels = sorted(
        set(sessions),
        key=lambda label: (not label.isdecimal(), int(label or 0) if label.isdecimal() else 0, label),
    )
    return sessions.map({label: place for place, label in enumerate(labels)}).astype(int)


def _unit_scale(trial: Array, group: NDArray[np.intp]) -> Array:
    """Return the trials' numbers from 0, the first of each group, to 1, the last."""
    count = int(group.max(initial=-1)) + 1
    first, last = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(first, group, trial)
    np.maximum.at(last, group, trial)
    scaled: Array = (trial - first[group]) / np.maximum(last - first, 1)[group]
    return scaled
