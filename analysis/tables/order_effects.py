"""The table of effects of order."""

from analysis.order_effects import OrderEffect
from analysis.study import Results
from analysis.tables.table import ResultTable, Row, end_cells, result_table
from autd_trials.records.table import Column

_COLUMNS = (
    Column("effect", "What answers may depend on."),
    Column("about", "What the estimate is."),
    Column("estimate", "Mean over participants, or difference between the orders of blocks."),
    Column("interval_low", "Lower end of its 95 % t interval."),
    Column("interval_high", "Upper end of its 95 % t interval."),
    Column("p", "Two-sided, not adjusted; n/a: not testable."),
    Column("participants", "Number of participants who tell something about it."),
    Column("method", "How p was found."),
)


def order_effect_table(results: Results) -> ResultTable:
    """Return the checks for effects of order."""
    return result_table(
        "order_effects",
        "Whether answers depend on when they were given: checks, not planned tests. Of several, one below "
        ".05 is no wonder.",
        _COLUMNS,
        map(_row, results.order_effects),
        simulated=results.simulated,
    )


def _row(effect: OrderEffect) -> Row:
    return {
        "effect": effect.name,
        "about": effect.about,
        "estimate": effect.estimate,
        **end_cells("interval", effect.interval),
        "p": effect.p,
        "participants": effect.participants,
        "method": effect.method,
        "notes": effect.note,
    }
