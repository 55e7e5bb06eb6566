"""The physics: air, transducers, field, focus."""

from typing import TYPE_CHECKING

from autd_trials.face import lazy

if TYPE_CHECKING:
    from autd_trials.acoustics.air import Air
    from autd_trials.acoustics.field import pressure
    from autd_trials.acoustics.focus_metrics import FocusMetrics, focus_force_mn
    from autd_trials.acoustics.scan import Scan, compare_scan, read_scan
    from autd_trials.acoustics.sources import Medium, Sources

__all__ = [
    "Air",
    "FocusMetrics",
    "Medium",
    "Scan",
    "Sources",
    "compare_scan",
    "focus_force_mn",
    "pressure",
    "read_scan",
]

__getattr__ = lazy(
    __name__,
    {
        "Air": "air",
        "FocusMetrics": "focus_metrics",
        "Medium": "sources",
        "Scan": "scan",
        "Sources": "sources",
        "compare_scan": "scan",
        "focus_force_mn": "focus_metrics",
        "pressure": "field",
        "read_scan": "scan",
    },
)
