"""What a rig file may say of its response device."""

# ruff: noqa: RUF001 - letters of other layouts are what is tested

from pathlib import Path
from typing import Any

import pytest
import yaml

from autd_trials.errors import UsageError
from autd_trials.rig.schema import KeyboardSpec, Rig, SerialSpec
from autd_trials.yamlfile import load_model
from autd_trials.yamlfile.shipped import find_file


def load(folder: Path, responses: dict[str, Any]) -> Rig:
    rig = yaml.safe_load(find_file("emulated", kind="rig", folder="rigs").read_text())
    path = folder / "rig.yaml"
    path.write_text(yaml.safe_dump(rig | {"responses": responses}, allow_unicode=True))
    return load_model(path, Rig)


@pytest.mark.parametrize("key", ["p", "n", "a", "A", "N", "\uff41", "ф", "з", "α", "せ", "ㅁ"])
def test_what_steers_the_session_is_no_response_key_on_any_layout(tmp_path: Path, key: str) -> None:
    with pytest.raises(UsageError, match=r"steers the session \(p: pause, .* a: abort\)") as refused:
        load(tmp_path, {"device": "keyboard", "keys": ["space", key]})
    assert str(tmp_path / "rig.yaml") in str(refused.value)


@pytest.mark.parametrize("key", ["pagedown", "", " ", "ab", "\x01", "\u3000", "F5"])
def test_what_is_no_key_is_refused_with_what_there_is(tmp_path: Path, key: str) -> None:
    with pytest.raises(UsageError, match="is no key; use a single character or one of space, enter, tab"):
        load(tmp_path, {"device": "keyboard", "keys": [key]})


@pytest.mark.parametrize("keys", [["j", "J"], ["j", "j"], ["space", "space"]])
def test_one_key_has_one_name(tmp_path: Path, keys: list[str]) -> None:
    with pytest.raises(UsageError, match="are one key"):
        load(tmp_path, {"device": "keyboard", "keys": keys})


def test_all_other_keys_are_taken(tmp_path: Path) -> None:
    keys = ("space", "enter", "tab", "j", "1", "+", "ö", "日")
    spec = load(tmp_path, {"device": "keyboard", "keys": list(keys)}).responses
    assert isinstance(spec, KeyboardSpec)
    assert spec.keys == keys


BOX: dict[str, Any] = {"device": "serial", "port": "/dev/ttyACM0", "protocol": {"kind": "line"}}


def test_a_rig_of_version_1_says_nothing_of_buttons(tmp_path: Path) -> None:
    spec = load(tmp_path, BOX).responses
    assert isinstance(spec, SerialSpec)
    assert spec.buttons is None


def test_buttons_are_declared(tmp_path: Path) -> None:
    spec = load(tmp_path, BOX | {"buttons": {"B1": "felt", "B2": "not_felt"}}).responses
    assert isinstance(spec, SerialSpec)
    assert spec.buttons == {"B1": "felt", "B2": "not_felt"}


@pytest.mark.parametrize("buttons", [{}, {"B1": "not_felt"}, {"B1": "maybe"}, {"": "felt"}])
def test_buttons_that_say_nothing_are_refused(tmp_path: Path, buttons: dict[str, str]) -> None:
    with pytest.raises(UsageError, match=r"rig\.yaml:\d+"):
        load(tmp_path, BOX | {"buttons": buttons})


@pytest.mark.parametrize("press", ["(?P<button>(a+)+b)(", "(?P<button>a)\\1", "(?P<button>(a*)*)", "B1"])
def test_an_expression_that_could_block_or_names_no_button_is_refused(tmp_path: Path, press: str) -> None:
    with pytest.raises(UsageError, match=r"rig\.yaml:\d+"):
        load(tmp_path, BOX | {"protocol": {"kind": "line", "press": press}})
