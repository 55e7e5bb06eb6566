"""Whether answers depend on when they were given."""

from collections.abc import Sequence

from autd_analysis.data.trials import Trials
from autd_analysis.order.numbers import OrderEffect, order_effects
from autd_analysis.order.tables import ORDER_EFFECTS
from autd_analysis.order.words import DEFINITIONS, words
from autd_analysis.rates import STEERED
from autd_analysis.subject import NotApplicable, Others, Subject


def _compute(trials: Trials, _results: Others) -> Sequence[OrderEffect] | NotApplicable:
    return STEERED if trials.design.method else order_effects(trials)


ORDER = Subject[Sequence[OrderEffect]](
    name="order",
    title="Effects of order",
    compute=_compute,
    definitions=DEFINITIONS,
    tables=(ORDER_EFFECTS,),
    words=words,
)
