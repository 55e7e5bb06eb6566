"""The table of effects of order."""

from collections.abc import Sequence

from autd_analysis.order.numbers import OrderEffect
from autd_analysis.report.table import Declared
from autd_trials.tables import Column, of

ORDER_EFFECTS = Declared[Sequence[OrderEffect], OrderEffect](
    "order_effects",
    "Whether answers depend on when they were given: checks, not planned tests. Of several, one below "
    ".05 is no wonder.",
    rows=lambda found: found,
    columns=(
        Column("effect", "What answers may depend on.", lambda effect: effect.name),
        Column("about", "What the estimate is.", lambda effect: effect.about),
        Column(
            "estimate",
            "Mean over participants, or difference between the orders of blocks.",
            lambda effect: effect.estimate,
        ),
        Column(
            "interval_low",
            "Lower end of its 95 % t interval.",
            of(lambda effect: effect.interval, lambda ends: ends.low),
        ),
        Column(
            "interval_high",
            "Upper end of its 95 % t interval.",
            of(lambda effect: effect.interval, lambda ends: ends.high),
        ),
        Column("p", "Two-sided, not adjusted; n/a: not testable.", lambda effect: effect.p),
        Column(
            "participants",
            "Number of participants whose responses determine it.",
            lambda effect: effect.participants,
        ),
        Column("method", "How p was found.", lambda effect: effect.method),
    ),
    notes=lambda effect: effect.note,
)
