"""Where the noise goes is logged, and a change is a fault like a lost device."""

import re
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.clock import RealClock
from autd_trials.errors import DeviceError
from autd_trials.masking.masker import MaskerEvent, Route
from autd_trials.masking.player import SoundMasker
from autd_trials.masking.route import change, route_in, silent
from tests.masking.conftest import SoundServer, wait_until

ROUTES = st.builds(
    Route,
    sink=st.sampled_from(["headphones", "speakers"]),
    description=st.just("Built-in audio"),
    port=st.sampled_from([None, "analog-output-headphones", "analog-output-speaker"]),
    volume_db=st.sampled_from([-120.0, -20.0, -3.0, 0.0]),
    muted=st.booleans(),
)


@given(before=ROUTES, now=ROUTES | st.none())
def test_only_the_same_route_is_no_change(before: Route, now: Route | None) -> None:
    assert (change(before, now) is None) == (before == now)


def listing(*, sink_mute: bool = False, stream_db: str = "-3.00 dB", process: str = "77") -> Any:
    def volume(left: str) -> dict[str, Any]:
        return {"front-left": {"db": left}, "front-right": {"db": "-9.00 dB"}}

    sink = {"index": 4, "name": "alsa.analog", "description": "Analogue", "mute": sink_mute}
    stream = {"sink": 4, "mute": False, "volume": volume(stream_db)}
    return {
        "sinks": [{**sink, "index": 3}, {**sink, "volume": volume("-2.00 dB"), "active_port": "headphones"}],
        "sink_inputs": [
            {**stream, "properties": {"application.process.id": "5"}},
            {**stream, "properties": {"application.process.id": process}},
        ],
    }


def test_the_route_is_that_of_the_process_with_both_volumes() -> None:
    found = route_in(listing(), 77)
    wanted = Route(sink="alsa.analog", description="Analogue", port="headphones", volume_db=-5.0, muted=False)
    assert found == wanted
    assert route_in(listing(process="78"), 77) is None
    muted, turned_down = route_in(listing(sink_mute=True), 77), route_in(listing(stream_db="-inf dB"), 77)
    assert muted is not None
    assert silent(muted)
    assert turned_down is not None
    assert not silent(turned_down), "the other ear still hears"
    assert not silent(wanted)


@pytest.fixture
def masker(sound_server: SoundServer) -> Iterator[SoundMasker]:
    sound_server.tell("load-module", "module-null-sink", "sink_name=speakers")
    masker = SoundMasker("default", -25.0, None, seed=7, clock=RealClock(), loop_s=2.0)
    yield masker
    masker.close()


def lost(masker: SoundMasker) -> MaskerEvent:
    found: list[MaskerEvent] = []

    def seen() -> bool:
        found.extend(event for event in masker.events() if event.kind == "lost")
        return bool(found)

    wait_until(seen, "the sound is lost", deadline_s=5)
    return found[0]


@pytest.mark.audio
def test_the_route_is_read_when_the_masker_opens(masker: SoundMasker, sound_server: SoundServer) -> None:
    sound_server.tell("set-sink-volume", "bench", "50%")
    route = masker.open().route
    assert route is not None
    assert (route.sink, route.muted) == ("bench", False)
    assert route.volume_db == pytest.approx(-18.06, abs=0.1)


CHANGES: dict[str, tuple[Callable[[SoundServer], tuple[str, ...]], str]] = {
    "moved": (lambda server: ("move-sink-input", server.stream(), "speakers"), "was moved from .*speakers"),
    "unplugged": (
        lambda _: ("unload-module", "module-null-sink"),
        "was moved|no longer reaches|takes no more",
    ),
    "sink muted": (lambda _: ("set-sink-mute", "bench", "1"), "was muted"),
    "stream muted": (lambda server: ("set-sink-input-mute", server.stream(), "1"), "was muted"),
    "sink's volume": (lambda _: ("set-sink-volume", "bench", "80%"), r"volume of .* from 0\.0 to -5\.8 dB"),
    "stream's volume": (
        lambda server: ("set-sink-input-volume", server.stream(), "120%"),
        r"volume of .* from 0\.0 to 4\.\d dB",
    ),
}


@pytest.mark.audio
@pytest.mark.parametrize("how", CHANGES)
def test_a_change_while_it_plays_is_a_loss(masker: SoundMasker, sound_server: SoundServer, how: str) -> None:
    words, message = CHANGES[how]
    masker.open()
    masker.start()
    changed_s = time.monotonic()
    sound_server.tell(*words(sound_server))
    event = lost(masker)
    assert event.time_s > changed_s
    assert re.search(message, event.detail)


@pytest.mark.audio
def test_a_change_before_the_noise_starts_is_noticed_too(
    masker: SoundMasker, sound_server: SoundServer
) -> None:
    masker.open()
    sound_server.tell("set-sink-volume", "bench", "10%")
    masker.start()
    assert "volume" in lost(masker).detail


@pytest.mark.audio
def test_a_muted_sink_is_refused(masker: SoundMasker, sound_server: SoundServer) -> None:
    sound_server.tell("set-sink-mute", "bench", "1")
    with pytest.raises(DeviceError, match=r"nothing would be heard: .*bench.* muted"):
        masker.open()
    sound_server.tell("set-sink-mute", "bench", "0")
    masker.open()


@pytest.mark.audio
def test_without_pactl_the_route_is_unknown_and_the_noise_plays(
    masker: SoundMasker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", "/nonexistent")
    assert masker.open().route is None
    masker.start()
    assert masker.events() == []
