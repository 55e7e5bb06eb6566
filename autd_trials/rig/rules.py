"""What a rig's keys must be to each other; asked when a rig file is loaded."""

from autd_trials.errors import UnsafeError
from autd_trials.rig.schema import Rig
from autd_trials.stimulus import LARGEST_LEVEL_DB, PUBLIC_LEVEL_DB


def refuse_loud(rig: Rig, where: str) -> None:
    """Refuse a rig that lets more reach the ears than is allowed without a reason, or at all.

    Parameters
    ----------
    rig
        The rig; an emulated array emits nothing, so that only a reason is asked for.
    where
        The rig's file, for the message.

    Raises
    ------
    UnsafeError
        More than 100 dB SPL without a reason, or more than 110 dB at a real array.
    """
    limits = rig.array.limits
    level_db = limits.largest_ear_level_db
    if level_db > LARGEST_LEVEL_DB and not rig.emulated:
        raise UnsafeError(
            f"array.limits.largest_ear_level_db is {level_db:g} dB SPL; at a real array the most is "
            f"{LARGEST_LEVEL_DB:g} dB",
            where=where,
            do=f"make it {PUBLIC_LEVEL_DB:g} (or up to {LARGEST_LEVEL_DB:g} with an ear_level_reason)",
        )
    if level_db > PUBLIC_LEVEL_DB and limits.ear_level_reason is None:
        raise UnsafeError(
            f"array.limits.largest_ear_level_db is {level_db:g} dB SPL, over the {PUBLIC_LEVEL_DB:g} dB for "
            "the public, and no reason is given",
            where=where,
            do="make it 100, or say in array.limits.ear_level_reason why more may reach the ears, and who "
            "approved it; the log keeps that",
        )
