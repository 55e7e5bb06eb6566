"""A planned comparison by a logistic mixed model: fixed effects of cells, a random slope of the contrast.

Where two levels are compared at a level of another factor, only the trials there are taken: a slope shared
with the other levels would be estimated too small where people differ from level to level, and there would be
more false positives than 5 % (docs/statistics.md has the table).

Where all or none were felt in a cell its logit is infinite. Then Firth's penalty is added (`models.cells`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from autd_analysis.basics.intervals import Interval, wald_interval
from autd_analysis.data.contrasts import Contrast
from autd_analysis.models.cells import compared_rows, is_separated, penalised, without
from autd_analysis.models.glmm import fit_glmm, likelihood_ratio
from autd_analysis.rates.numbers import ParticipantRate


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


def mixed_model_test(rates: Sequence[ParticipantRate], contrast: Contrast) -> MixedModelTest | None:
    """Test the difference of two levels of a factor.

    Parameters
    ----------
    rates
        Rates in the single cells.
    contrast
        What is compared; at a level of another factor, by the trials there alone.

    Returns
    -------
    MixedModelTest | None
        None with fewer than 4 participants, without trials in a cell that is compared, or if nothing
        converged.
    """
    compared = compared_rows(rates, contrast)
    if compared is None:
        return None
    rows, weights = compared
    separated = is_separated(rows)
    if separated:
        rows = penalised(rows)
    full, reduced = fit_glmm(rows), fit_glmm(without(rows, weights[None]))
    if not (full.converged and reduced.converged):
        return None
    statistic, p = likelihood_ratio(full, reduced, df=1)
    logits = float(weights @ full.coefficients)
    return MixedModelTest(
        logits=logits,
        interval=wald_interval(logits, float(np.sqrt(weights @ full.covariance @ weights))),
        statistic=statistic,
        p=p,
        slope_sd=float(full.standard_deviations[1]),
        penalised=separated,
        singular=full.singular,
    )
