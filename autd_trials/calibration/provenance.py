"""Where data come from: measured, simulated or made up; by which sensor, and when they were taken.

Every step passes it on. A track has it in a file beside it (``unit1.provenance.json`` beside ``unit1.csv``),
which holds the SHA-256 of the track, so that it cannot stand for another one.
"""

from collections.abc import Sequence
from datetime import datetime, timedelta
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Literal, TypedDict

from pydantic import AwareDatetime, Field, ValidationError

from autd_trials.errors import UsageError
from autd_trials.model import Model

Origin = Literal["measured", "unknown", "simulated", "made up"]
"""From best to worst; a result is as good as the worst of what it rests on."""

_ORDER: tuple[Origin, ...] = ("measured", "unknown", "simulated", "made up")

Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]

CLOCK_TOLERANCE = timedelta(minutes=5)
"""By how much the clocks of two computers may differ before a time counts as lying in the future."""

MOST_LETTERS = 200
"""Of what names a sensor."""


class Capture(Model):
    """What took data, and when."""

    origin: Origin = Field(description="How far the data can be trusted to be of the real world.")
    sensor: str = Field(max_length=MOST_LETTERS, description="Kind of sensor; empty if unknown.")
    serial: str = Field("", max_length=MOST_LETTERS, description="Its serial number; empty if unknown.")
    taken: AwareDatetime | None = Field(
        None, description="When the first of the data were taken, by the wall clock; left out if unknown."
    )

    def at(self, now: datetime) -> "Capture":
        """Return the same for data that are taken now, unless they were taken earlier (a replay)."""
        if self.taken is not None or self.origin == "unknown":
            return self
        return self.model_copy(update={"taken": now})


UNKNOWN = Capture(origin="unknown", sensor="")
"""Of files that do not say where they come from."""


class Source(Capture):
    """One of the files that a calibration rests on."""

    what: Literal["track", "pairs", "sound", "wand", "mounts", "calibration", "start"] = Field(
        description="What it holds; 'calibration' gave poses that were kept, 'start' only where to begin."
    )
    file: str = Field(description="The file, as in inputs.")


_DATED = ("track", "pairs", "sound", "calibration")
"""Sources that show where the units stood; mounts and range errors stay when a unit is moved."""


def source(what: str, path: Path | str, capture: Capture) -> Source:
    """Return a source: a file and where it comes from."""
    return Source.model_validate({"what": what, "file": str(path), **capture.model_dump()})


def worst(origins: Sequence[Origin]) -> Origin:
    """Return the origin of what rests on several; unknown if on none."""
    return max(origins, key=_ORDER.index, default="unknown")


def taken_of(sources: Sequence[Source]) -> datetime | None:
    """Return when the oldest data about the units' places were taken; None if that is not known of all."""
    times = [each.taken for each in sources if each.what in _DATED]
    known = [time for time in times if time is not None]
    return min(known) if known and len(known) == len(times) else None


class Provenance(TypedDict):
    """What a calibration says of its sources."""

    made_up: bool
    origin: Origin
    taken: datetime | None
    sources: tuple[Source, ...]


def provenance(sources: Sequence[Source]) -> Provenance:
    """Return what is to be said of a calibration that rests on some sources."""
    origin = worst([each.origin for each in sources])
    made_up = origin in ("simulated", "made up")
    return Provenance(made_up=made_up, origin=origin, taken=taken_of(sources), sources=tuple(sources))


class _Sidecar(Model):
    sha256: Sha256 = Field(description="Of the data that this is about.")
    capture: Capture


def sidecar_path(path: Path) -> Path:
    """Return the file beside a file of data that says where they come from."""
    return path.with_suffix(".provenance.json")


def sidecar_text(capture: Capture, data: bytes) -> str:
    """Return what stands beside a file with these bytes."""
    return _Sidecar(sha256=sha256(data).hexdigest(), capture=capture).model_dump_json(indent=1) + "\n"


def read_capture(path: Path) -> Capture:
    """Return where a file of data comes from, as the file beside it says; `UNKNOWN` if there is none.

    Raises
    ------
    UsageError
        The file beside it cannot be read, or is about other data.
    """
    beside = sidecar_path(path)
    if beside == path:
        return UNKNOWN
    try:
        if not beside.exists():
            return UNKNOWN
        sidecar = _Sidecar.model_validate_json(beside.read_bytes())
        digest = sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise UsageError(f"the file cannot be read: {error.strerror}", where=str(beside)) from error
    except ValidationError as error:
        raise UsageError(
            f"this does not say where {path.name} comes from: {error.errors()[0]['msg']}",
            where=str(beside),
            do="restore it; without it the origin of the data counts as unknown",
        ) from error
    if sidecar.sha256 != digest:
        raise UsageError(
            f"this is about other data than {path.name}: their SHA-256 differs",
            where=str(beside),
            do="restore the track as it was recorded; without this file its origin counts as unknown",
        )
    return sidecar.capture


class Inputs:
    """Collects the files that a calibration rests on: their SHA-256, and where they come from.

    Parameters
    ----------
    stated
        What a person says of files that do not say it themselves; None if nothing.
    now
        Data cannot be taken later; aware.
    """

    def __init__(self, stated: Capture | None, now: datetime) -> None:
        self._stated = stated
        self._now = now
        self.sha256: dict[str, str] = {}
        self.sources: list[Source] = []

    def add_data(self, what: str, path: Path) -> None:
        """Add a file of data.

        Raises
        ------
        UsageError
            It cannot be read, or was taken in the future; or the file beside it is wrong.
        """
        capture = read_capture(path)
        try:
            digest = sha256(path.read_bytes()).hexdigest()
        except OSError as error:
            raise UsageError(f"the file cannot be read: {error.strerror}", where=str(path)) from error
        self.add(what, path, digest, self._stated if self._stated and capture == UNKNOWN else capture)

    def add(self, what: str, path: Path | str, digest: str, capture: Capture) -> None:
        """Add a file that has been read.

        Raises
        ------
        UsageError
            It was taken in the future.
        """
        if capture.taken is not None:
            refuse_future(capture.taken, self._now, str(path))
        self.sha256[str(path)] = digest
        self.sources.append(source(what, path, capture))


def refuse_future(taken: datetime, now: datetime, where: str) -> None:
    """Refuse data that were taken later than now.

    Raises
    ------
    UsageError
        They lie more than `CLOCK_TOLERANCE` in the future.
    """
    if taken - now > CLOCK_TOLERANCE:
        raise UsageError(
            f"the data were taken at {taken.isoformat()}, which lies in the future: the clock here says "
            f"{now.isoformat(timespec='seconds')}",
            where=where,
            do="set this computer's clock; if it is right, the one that recorded was wrong: record again",
        )
