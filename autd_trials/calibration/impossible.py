"""Results that cannot be, refused with their likely cause."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from autd_trials.calibration.registration import Registered
from autd_trials.errors import UsageError

_NEAREST_SENSORS_MM = 50.0  # units are half a metre wide
_SAME_POINTS_MM = 0.02  # no two sensors agree so well


def refuse_impossible(registered: Registered, names: Sequence[str], cameras: Sequence[bool]) -> None:
    """Refuse units in one place, and one unit's points given twice.

    Parameters
    ----------
    registered
        The poses that were found.
    names
        Of the units.
    cameras
        Which units' points were seen from the origin of their frame: these cannot stand in one place.

    Raises
    ------
    UsageError
        Two units are one.
    """
    for one, other in combinations(range(len(names)), 2):
        both = f"{names[one]} and {names[other]}"
        gaps_mm = np.linalg.norm(registered.places_mm[one] - registered.places_mm[other], axis=1)
        apart_mm = float(
            np.linalg.norm(registered.motions[one].translation_mm - registered.motions[other].translation_mm)
        )
        counted = gaps_mm[registered.inliers[one] & registered.inliers[other]]
        if len(counted) and np.median(counted) < _SAME_POINTS_MM and apart_mm < _NEAREST_SENSORS_MM:
            raise UsageError(
                f"{both} saw the same points to {_SAME_POINTS_MM} mm, as no two sensors do",
                do="see that the same file was not given twice",
            )
        if cameras[one] and cameras[other] and apart_mm < _NEAREST_SENSORS_MM:
            raise UsageError(
                f"{both} would stand in one place: their sensors come out {apart_mm:.1f} mm apart",
                do="see that both tracks do not come from the same sensor, and that they are in the sensors' "
                "own frames and not in a common one",
            )
