"""Events are strict to the last field, and those of version 1 are still read."""

import json
from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from autd_trials.session.events import Event, Resume
from autd_trials.testing.script import SessionScript

EVENT: TypeAdapter[Event] = TypeAdapter(Event)
UTC_TEXT = "2026-11-22T09:00:00.000000+00:00"


def line(kind: str, **changes: Any) -> str:
    script = SessionScript().block(1).trial(1).pause().resume().note("x").fault().end()
    event = next(event for event in script.events if event.event == kind)
    return json.dumps(event.model_dump(mode="json") | changes)


@pytest.mark.parametrize(
    "kind",
    [
        "session-start",
        "block-start",
        "trial-start",
        "stimulus",
        "response",
        "trial-end",
        "pause",
        "resume",
        "note",
        "fault",
        "session-end",
    ],
)
def test_every_kind_is_read_back_as_it_was(kind: str) -> None:
    event = EVENT.validate_json(line(kind))
    assert json.loads(event.model_dump_json()) == json.loads(line(kind))
    for changes in ({"utc": "yesterday"}, {"utc": ""}, {"t_s": -1.0}, {"t_s": "0"}, {"more": 1}):
        with pytest.raises(ValidationError):
            EVENT.validate_json(line(kind, **changes))


@pytest.mark.parametrize(
    "utc",
    [
        "2026-11-22T09:00:00",
        "0001-01-01T00:00:00+23:59",
        "9999-12-31T23:59:59-23:59",
        "1969-12-31T23:59:59+00:00",
        "2026-02-30T00:00:00+00:00",
    ],
)
def test_a_time_that_cannot_be_reckoned_with_is_none(utc: str) -> None:
    with pytest.raises(ValidationError, match="not a time"):
        EVENT.validate_json(line("note", utc=utc))


@pytest.mark.parametrize(
    ("kind", "changes"),
    [
        ("stimulus", {"exposure_s": -1.0}),
        ("stimulus", {"drive": 1.5}),
        ("stimulus", {"trial": 0}),
        ("stimulus", {"margin_s": 1e999}),
        ("trial-start", {"attempt": 0}),
        ("trial-start", {"trial": True}),
        ("trial-end", {"status": "done"}),
        ("trial-end", {"underruns": -1}),
        ("session-start", {"devices": {}}),
        ("session-start", {"simulated": "true"}),
        ("session-start", {"format": 3}),
    ],
)
def test_values_that_cannot_be_are_refused(kind: str, changes: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        EVENT.validate_json(line(kind, **changes))


def test_what_version_1_wrote_is_read() -> None:
    """It had no limits, no host time, no `started`, and an empty object where devices were not known."""
    old = json.loads(line("session-start", format=1))
    for name in ("limits", "exposure_today_s", "host"):
        del old[name]
    assert EVENT.validate_python(EVENT.validate_json(json.dumps(old))).event == "session-start"
    resume = EVENT.validate_json(
        '{"t_s":1.0,"utc":"' + UTC_TEXT + '","event":"resume","after_crash":true,'
        '"confirmed_by":"person","devices":{},"versions":{}}'
    )
    assert isinstance(resume, Resume)
    assert resume.devices is None
    end = json.loads(line("trial-end"))
    del end["started"]
    assert EVENT.validate_json(json.dumps(end)).event == "trial-end"
