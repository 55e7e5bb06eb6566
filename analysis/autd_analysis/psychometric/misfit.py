"""Whether psychometric functions describe the answers at all, in words for whoever reads their thresholds."""

import math
from collections.abc import Iterator, Sequence

from autd_analysis.data.design import describe_condition
from autd_analysis.psychometric.numbers import PsychometricResults

ALPHA = 0.05
_MOST_NAMED = 5


def misfits(results: Sequence[PsychometricResults]) -> Iterator[str]:
    """Yield a sentence for each factor along which functions do not fit.

    Of many functions one in twenty has a deviance p under .05 though it fits. So it is said if more have than
    chance gives (binomial), or if one stands out of all (Bonferroni).

    Parameters
    ----------
    results
        The functions along each factor.
    """
    for along in results:
        tested = [
            (curve.resampled.goodness.p, curve)
            for curve in along.participants
            if curve.resampled is not None and curve.resampled.goodness is not None
        ]
        bad = sorted((found for found in tested if found[0] <= ALPHA), key=lambda found: found[0])
        if not bad or min(_by_chance(len(bad), len(tested)), bad[0][0] * len(tested)) > ALPHA:
            continue
        named = "; ".join(
            f"sub-{curve.participant}"
            + (f", {describe_condition(curve.condition)}" if curve.condition else "")
            + f": {p:.2g}"
            for p, curve in bad[:_MOST_NAMED]
        )
        more = f"; and {len(bad) - _MOST_NAMED} more" if len(bad) > _MOST_NAMED else ""
        yield (
            f"{len(bad)} of {len(tested)} psychometric functions along {along.along} do not fit the answers "
            f"(deviance p {named}{more}), so do not trust their thresholds; another form or lapse rate "
            "may fit: --core weibull or --lapse shared"
        )


def _by_chance(count: int, of: int) -> float:
    """Return the chance that so many of so many tests, or more, have p under `ALPHA`."""
    terms = (math.comb(of, k) * ALPHA**k * (1 - ALPHA) ** (of - k) for k in range(count, of + 1))
    return math.fsum(terms)
