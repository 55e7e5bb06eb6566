"""Staircases, plain and weighted, on a ladder of levels."""

import math
import statistics
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from autd_trials.adaptive.answers import Answer, Estimate
from autd_trials.protocol.method import Staircase

FEWEST_REVERSALS = 4
"""With fewer reversals no threshold is estimated."""

LARGEST_SHARE_CUT_OFF = 1 / 6
"""Where more of the turns would have left the range at one end the reversals are held there, and their mean
is wrong: with 1-up-2-down and 40 trials by 0.9 dB if the threshold lies just at the end (simulated)."""


@dataclass(frozen=True)
class Step:
    """What followed from an answer.

    Attributes
    ----------
    level
        The level that was answered.
    turned
        Whether the answer led to a step, up or down.
    reversal
        Whether the staircase turned there, having come with steps of the final size.
    cut_off
        1 or -1 where the step would have left the range at its largest or smallest level, else 0.
    next_level
        Where it went.
    """

    level: float
    turned: bool
    reversal: bool
    cut_off: int
    next_level: float


class StaircaseRule:
    """Down after n trials felt in a row, up after one not felt; the steps shrink with the reversals."""

    def __init__(self, method: Staircase) -> None:
        self._method = method

    def next_level(self, answers: Sequence[Answer]) -> float:
        """Return the level of the next trial."""
        steps = self.steps(answers)
        return steps[-1].next_level if steps else self._method.levels[self._place(self._method.start)]

    def steps(self, answers: Sequence[Answer]) -> list[Step]:
        """Return what followed from each answer."""
        return list(self._walk(answers))

    def estimate(self, answers: Sequence[Answer]) -> Estimate:
        """Return the geometric mean of an even number of reversals, as Levitt (1971) has it.

        Peaks and valleys then count the same. The first one goes where their number is odd.
        """
        steps = self.steps(answers)
        found = [math.log(step.level) for step in steps if step.reversal]
        kept = found[len(found) % 2 :]
        rate = self._method.converges_to
        for end, where in ((1, "largest"), (-1, "smallest")):
            cut_off = sum(step.cut_off == end for step in steps)
            if cut_off > LARGEST_SHARE_CUT_OFF * sum(step.turned for step in steps):
                note = f"held at the {where} level by {cut_off} steps: it lies beyond or close to it"
                return Estimate(None, rate, None, end, note)
        if len(kept) < FEWEST_REVERSALS:
            note = f"{len(found)} reversals with the final steps; a threshold needs {FEWEST_REVERSALS}"
            return Estimate(None, rate, None, note=note)
        return Estimate(
            threshold=math.exp(statistics.fmean(kept)),
            rate=rate,
            spread_db=20 / math.log(10) * statistics.stdev(kept),
        )

    def _walk(self, answers: Sequence[Answer]) -> Iterator[Step]:
        method, last = self._method, len(self._method.levels) - 1
        direction = reversals = felt_in_a_row = 0
        for answer in answers:
            felt_in_a_row = felt_in_a_row + 1 if answer.felt else 0
            turn = 1 if not answer.felt else -1 if felt_in_a_row == method.felt_to_go_down else 0
            reversal = turn * direction == -1
            final = reversals >= len(method.step_factors) - 1
            if turn:
                direction, felt_in_a_row = turn, 0
                reversals += reversal
            factor = method.step_factors[min(reversals, len(method.step_factors) - 1)]
            wanted = self._place(answer.level) + factor * self._size(turn)
            place = min(max(wanted, 0), last)
            cut_off = (wanted > last) - (wanted < 0)
            yield Step(answer.level, turn != 0, reversal and final, cut_off, method.levels[place])

    def _size(self, turn: int) -> int:
        """Return by how many levels a turn moves before it is multiplied."""
        return self._method.step_up if turn > 0 else turn * self._method.step_down

    def _place(self, level: float) -> int:
        """Return the place of the nearest level."""
        levels = self._method.levels
        return min(range(len(levels)), key=lambda place: abs(math.log(levels[place] / level)))
