"""A planned comparison by a logistic mixed model: fixed effects of cells, a random slope of the contrast.

Where two levels are compared at a level of another factor, only the trials there are taken: a slope shared
with the other levels would be estimated too small where people differ from level to level, and there would be
more false positives than 5 % (docs/statistics.md has the table).

Where all or none were felt in a cell its logit is infinite. Then Firth's penalty is added (`models.cells`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from autd_analysis.design import Condition
from autd_analysis.intervals import Interval, wald_interval
from autd_analysis.models.cells import Compared, NoModel, compared_rows, is_separated, penalised
from autd_analysis.models.glmm import TROUBLES, Nested, fit_nested
from autd_analysis.rates import ParticipantRate
from autd_trials.protocol.schema import Level


@dataclass(frozen=True)
class MixedModelTest:
    """A difference of two levels in logits.

    Attributes
    ----------
    logits
        Estimated difference of the logits, first minus second, for a participant with average random effects.
    interval
        Wald 95 % interval.
    statistic, p
        Likelihood-ratio test with one degree of freedom.
    slope_sd
        Standard deviation over participants of the difference, in logits.
    penalised
        Whether answers are separated, so that Firth's penalty keeps the estimates finite.
    singular
        Whether a variance was estimated as zero or a correlation as 1.
    """

    logits: float
    interval: Interval
    statistic: float
    p: float
    slope_sd: float
    penalised: bool
    singular: bool


def mixed_model_test(
    rates: Sequence[ParticipantRate], factor: str, first: Level, second: Level, at: Condition
) -> MixedModelTest | NoModel:
    """Test the difference of two levels of a factor.

    Parameters
    ----------
    rates
        Rates in the single cells.
    factor, first, second
        What is compared.
    at
        The level of another factor at which it is compared, by the trials there alone; over all cells if
        empty.

    Returns
    -------
    MixedModelTest | NoModel
        The cause with fewer than 4 participants, without trials in a cell that is compared, or where the fit
        is in trouble.
    """
    compared = compared_rows(rates, Compared(factor, first, second), at)
    if isinstance(compared, NoModel):
        return compared
    rows, weights = compared
    separated = is_separated(rows)
    if separated:
        rows = penalised(rows)
    tested = fit_nested(rows, weights[None])
    if not isinstance(tested, Nested):
        return NoModel(TROUBLES[tested])
    full = tested.full
    logits = float(weights @ full.coefficients)
    return MixedModelTest(
        logits=logits,
        interval=wald_interval(logits, float(np.sqrt(weights @ full.covariance @ weights))),
        statistic=tested.statistic,
        p=tested.p,
        slope_sd=float(full.standard_deviations[1]),
        penalised=separated,
        singular=full.singular,
    )
