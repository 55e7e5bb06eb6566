import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml
from pydantic import BaseModel

from autd_trials.errors import UsageError
from autd_trials.protocol.schema import Protocol
from autd_trials.rig.schema import Rig
from autd_trials.yamlfile.json_schema import json_schema
from autd_trials.yamlfile.shipped import find_file, shipped_names

SHIPPED: list[tuple[str, str, type[BaseModel]]] = [
    ("", name, Protocol) for name in ("chest", "chest-catch", "chest-threshold", "pilot")
]
SHIPPED += [("rigs", name, Rig) for name in ("emulated", "lab")]


def test_bare_names_are_found_with_and_without_their_ending() -> None:
    assert find_file("chest", kind="protocol").name == "chest.yaml"
    assert find_file("chest.yaml", kind="protocol").name == "chest.yaml"
    assert {"chest", "chest-catch", "pilot"} <= set(shipped_names())


def test_a_file_in_the_current_folder_goes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "chest.yaml").write_text("mine: true\n")
    assert find_file("chest.yaml", kind="protocol").resolve().parent == tmp_path


@pytest.mark.parametrize("name", ["ches", "", "no/such.yaml", "x" * 5000, "a\0b", ".."])
def test_a_wrong_name_lists_the_shipped_ones(name: str) -> None:
    with pytest.raises(UsageError, match="chest, chest-catch, chest-threshold, pilot") as caught:
        find_file(name, kind="protocol")
    assert ("did you mean 'chest'" in str(caught.value)) == (name == "ches")


def _data(folder: str, name: str) -> dict[str, Any]:
    text = find_file(name, kind="file", folder=folder).read_text(encoding="utf-8")
    data: dict[str, Any] = json.loads(json.dumps(yaml.safe_load(text), default=str))
    return data


@pytest.mark.parametrize(("folder", "name", "model"), SHIPPED)
def test_editors_accept_the_shipped_files_and_find_mistakes(
    folder: str, name: str, model: type[BaseModel]
) -> None:
    schema = json_schema(model)
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    data = _data(folder, name)
    assert list(validator.iter_errors(data)) == []
    assert list(validator.iter_errors({**data, "nmae": "x"})) != []
    assert list(validator.iter_errors({**data, "name": 3})) != []
    assert list(validator.iter_errors({key: value for key, value in data.items() if key != "name"})) != []
