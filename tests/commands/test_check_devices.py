"""`check --devices` opens everything that the rig names, and says per device what was found."""

from typing import Any

import pytest

from tests.commands.conftest import Run, WriteRig, make_real
from tests.conftest import PseudoTerminal
from tests.masking.conftest import SoundServer

Data = dict[str, Any]


def serial(port: str) -> Data:
    return {"device": "serial", "port": port, "protocol": {"kind": "line", "baud": 115200}}


@pytest.mark.emulator
def test_the_emulated_rig_opens(run: Run) -> None:
    done = run("check", "chest", "--devices", "--json")
    assert done.code == 0
    found = done.json["devices"]
    assert {name: device["ok"] for name, device in found.items()} == dict.fromkeys(
        ("array", "sound", "responses"), True
    )
    assert "18 emulated devices ready" in found["array"]["found"]
    assert "devices" not in run("check", "chest", "--json").json


@pytest.mark.emulator
def test_a_missing_port_and_a_missing_sound_device_are_both_told(run: Run, write_rig: WriteRig) -> None:
    def change(rig: Data, _calibration: Data) -> None:
        rig["sound"] = {"player": "portaudio", "device": "no such card"}
        rig["responses"] = serial("/dev/nosuchport")

    done = run("check", "chest", "--rig", write_rig(change), "--devices")
    assert done.code == 4
    assert "18 emulated devices ready" in done.out
    for place in (done.out, done.err):
        assert "no such card" in place
        assert "/dev/nosuchport" in place


def test_a_missing_network_interface_is_told(run: Run, write_rig: WriteRig) -> None:
    def change(rig: Data, calibration: Data) -> None:
        make_real(rig, calibration)
        rig["hearing_protection_db"] = 60

    done = run("check", "chest", "--rig", write_rig(change), "--devices")
    assert done.code == 4
    assert "nosuchnic0" in done.err


@pytest.mark.audio
@pytest.mark.emulator
def test_a_box_and_a_sound_card_that_are_there_are_described(
    run: Run, write_rig: WriteRig, line: PseudoTerminal, sound_server: SoundServer
) -> None:
    def change(rig: Data, _calibration: Data) -> None:
        rig["sound"] = {"player": "portaudio", "device": "default"}
        rig["responses"] = serial(line.name)

    done = run("check", "chest", "--rig", write_rig(change), "--devices", "--json")
    assert done.code == 0, done.err
    assert "(bench) at 0.0 dB" in done.json["devices"]["sound"]["found"]
    assert line.name in done.json["devices"]["responses"]["found"]
    assert sound_server.players() == []
