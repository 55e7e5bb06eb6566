"""What is not as before where a session goes on: it is recorded, and refused where it is less safe."""

from collections.abc import Iterator

from pydantic import JsonValue

from autd_trials.errors import UnsafeError, UsageError
from autd_trials.session.events import DeviceDescriptions, Json
from autd_trials.session.standing import Standing
from autd_trials.stimulus import Limits

_PROTECTIONS = ("largest_ear_level_db", "hearing_protection_db")
"""Numbers of a rig that let more sound reach the ears the larger they are."""


def rig_changes(before: Standing, rig: Json, calibration_sha256: str) -> tuple[str, ...]:
    """Return a line for each fact of the rig that is not as it was, and one for another calibration."""
    changes = list(_differences("rig", dict(before.rig), dict(rig)))
    if calibration_sha256 != before.calibration_sha256:
        changes.append(f"calibration: sha256 {before.calibration_sha256} -> {calibration_sha256}")
    return tuple(changes)


def device_changes(before: DeviceDescriptions, now: DeviceDescriptions) -> tuple[str, ...]:
    """Return a line for each thing that the devices say otherwise than before; addresses are new."""
    said = (before.model_dump(mode="json"), now.model_dump(mode="json"))
    return tuple(line for line in _differences("devices", *said) if not line.startswith("devices.array.link"))


def refuse_less_safe(before: Standing, rig: Json, limits: Limits) -> None:
    """Refuse to go on with another kind of array, under looser limits, or with more sound at the ears.

    Raises
    ------
    UsageError
        An emulated array in place of a real one, or the other way round: one would pass as the other.
    UnsafeError
        A limit is looser than it was.
    """
    was, would_be = (_emulated(known) for known in (before.rig, rig))
    if was is not None and was != would_be:
        kinds = {True: "an emulated array", False: "a real array", None: "an array of unknown kind"}
        raise UsageError(
            f"the session was begun on {kinds[was]}, and would go on with {kinds[would_be]}",
            do="go on with the rig that it was begun with, or begin a new session",
        )
    looser = [
        f"{name} from {getattr(before.limits, name):g} to {getattr(limits, name):g}"
        for name in Limits.model_fields
        if getattr(limits, name) > getattr(before.limits, name)
    ]
    found = ((name, _find(dict(before.rig), name), _find(dict(rig), name)) for name in _PROTECTIONS)
    looser += [
        f"{name} from {was:g} to {now:g}"
        for name, was, now in found
        if was is not None and now is not None and was < now
    ]
    if looser:
        raise UnsafeError(
            f"the session would go on under looser limits: {'; '.join(looser)}",
            do="go on with the rig that it was begun with, or begin a new session",
        )


def _differences(name: str, before: JsonValue, now: JsonValue) -> Iterator[str]:
    if isinstance(before, dict) and isinstance(now, dict):
        for key in sorted(before.keys() | now.keys()):
            yield from _differences(f"{name}.{key}", before.get(key), now.get(key))
    elif before != now:
        yield f"{name}: {_said(before)} -> {_said(now)}"


def _said(value: JsonValue) -> str:
    return "none" if value is None else str(value)


def _emulated(rig: Json) -> bool | None:
    """Return whether a rig's array is the emulator; None where a log does not say."""
    array = rig.get("array")
    link = array.get("link") if isinstance(array, dict) else None
    return None if link is None else link == "emulator"


def _find(data: JsonValue, name: str) -> float | None:
    """Return a number by its key, wherever in a rig it stands; None if it is nowhere."""
    if not isinstance(data, dict):
        return None
    value = data.get(name)
    if isinstance(value, int | float):
        return float(value)
    return next((found for inner in data.values() if (found := _find(inner, name)) is not None), None)
