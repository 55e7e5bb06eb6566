"""Whatever `check` accepts, `run --simulate` completes and `analyse` analyses."""

import json
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, given, settings

from tests.commands.conftest import Run, of
from tests.protocols import protocols

REFUSED = {2, 5}
HEALTH = (HealthCheck.function_scoped_fixture, HealthCheck.too_slow, HealthCheck.data_too_large)


@settings(max_examples=10, suppress_health_check=HEALTH)
@given(data=protocols())
def test_what_is_accepted_is_completed(run: Run, data: dict[str, Any]) -> None:
    with completed(run, data):
        pass


@pytest.mark.slow
@pytest.mark.timeout(600)
@settings(max_examples=8, suppress_health_check=HEALTH)
@given(data=protocols())
def test_what_is_accepted_is_analysed(run: Run, data: dict[str, Any]) -> None:
    with completed(run, data) as study:
        if study is not None:
            analysed = run("analyse", study, "--json")
            assert analysed.code == 0, analysed.err
            assert analysed.json["participants"] == 1


@contextmanager
def completed(run: Run, data: dict[str, Any]) -> Iterator[Path | None]:
    """Check a protocol and run a session of it; None if it was refused."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "protocol.yaml")
        path.write_text(yaml.safe_dump(data, sort_keys=False, allow_unicode=True), encoding="utf-8")
        checked = run("check", path, "--json")
        if checked.code in REFUSED:
            yield None
            return
        assert checked.code == 0
        ran = run("run", path, "--simulate", 1, "--seed", 1, "--data", folder)
        assert ran.code == 0, ran.err
        (end,) = of("session-end", Path(folder))
        assert end["status"] == "success"
        complete = [trial for trial in of("trial-end", Path(folder)) if trial["status"] == "complete"]
        assert len(complete) == json.loads(checked.out)["trials"]
        yield Path(folder, data["name"])
