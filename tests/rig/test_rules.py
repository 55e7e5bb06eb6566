"""How much may reach the ears is limited whatever the rig file says."""

import json
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from autd_trials.errors import UnsafeError
from autd_trials.rig.load import load_rig
from autd_trials.rig.rules import refuse_loud
from autd_trials.rig.schema import Rig
from autd_trials.yamlfile.shipped import find_file
from tests.rig.test_poses import NOW, made_real, write_rig


def rig_with(*, link: Any, **limits: Any) -> Rig:
    """The emulated rig's file with another link and other limits."""
    data = yaml.safe_load(find_file("emulated", kind="rig", folder="rigs").read_text())
    data["array"]["link"] = link
    del data["array"]["limits"]["largest_ear_level_db"], data["array"]["limits"]["ear_level_reason"]
    data["array"]["limits"] |= limits
    return Rig.model_validate_json(json.dumps(data))


@given(level_db=st.floats(1, 180), reason=st.none() | st.just("approved"), real=st.booleans())
@settings(deadline=None)
def test_over_100_db_only_with_a_reason_and_over_110_never_at_a_real_array(
    level_db: float, reason: str | None, real: bool
) -> None:
    link = {"interface": "none0"} if real else "emulator"
    rig = rig_with(link=link, largest_ear_level_db=level_db, ear_level_reason=reason)
    allowed = level_db <= 100 or (reason is not None and (level_db <= 110 or not real))
    if allowed:
        refuse_loud(rig, "rig.yaml")
        return
    with pytest.raises(UnsafeError, match=r"largest_ear_level_db is .* dB SPL"):
        refuse_loud(rig, "rig.yaml")


def test_100_db_is_what_holds_where_nothing_is_said() -> None:
    assert rig_with(link="emulator").array.limits.largest_ear_level_db == 100


def test_a_loud_rig_is_refused_when_it_is_loaded(tmp_path: Path) -> None:
    path = made_real(tmp_path, write_rig(tmp_path))
    load_rig(str(path), NOW)
    rig = yaml.safe_load(path.read_text())
    rig["array"]["limits"]["largest_ear_level_db"] = 111
    path.write_text(yaml.safe_dump(rig))
    with pytest.raises(UnsafeError, match=r"rig\.yaml.*111 dB SPL; at a real array the most is 110 dB"):
        load_rig(str(path), NOW)
