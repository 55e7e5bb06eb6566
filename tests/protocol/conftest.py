"""Protocols that the tests bend."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from autd_trials.errors import UsageError
from autd_trials.protocol.load import find_protocol, load_protocol
from autd_trials.protocol.schema import Protocol

Change = Callable[[dict[str, Any]], object]
Load = Callable[..., Protocol]
Refuse = Callable[..., str]


@pytest.fixture
def load(tmp_path: Path) -> Load:
    """Return what loads a shipped protocol after a change to its data."""

    def load_changed(change: Change = lambda _data: None, name: str = "chest") -> Protocol:
        data = yaml.safe_load(find_protocol(name).read_text(encoding="utf-8"))
        change(data)
        path = tmp_path / "changed.yaml"
        path.write_text(yaml.safe_dump(data, sort_keys=False), encoding="utf-8")
        return load_protocol(path)

    return load_changed


@pytest.fixture
def refuse(load: Load) -> Refuse:
    """Return what loads a changed protocol and gives back the refusal."""

    def refusal(change: Change, name: str = "chest") -> str:
        with pytest.raises(UsageError, match=r"changed\.yaml:\d+:\d+: ") as caught:
            load(change, name)
        return str(caught.value)

    return refusal
