"""Ids that people take for each other are refused."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.errors import UsageError
from autd_trials.records.ids import look_alike, refuse_look_alikes

ALIKE = [
    ("1", "01"),
    ("01", "001"),
    ("1", "001"),
    ("ab", "AB"),
    ("O7", "07"),
    ("o7", "7"),
    ("l5", "15"),
    ("I5", "15"),
    ("P01", "P1"),
    ("P01", "p1"),
    ("sim01", "sim1"),
    ("0", "00"),
]
DIFFERENT = [("1", "10"), ("01", "10"), ("1", "11"), ("P1", "1"), ("a0", "a"), ("ab", "abc"), ("100", "10")]


@pytest.mark.parametrize(("one", "other"), ALIKE)
@pytest.mark.parametrize("root", ["", "sourcedata"])
def test_look_alikes_are_refused(tmp_path: Path, one: str, other: str, root: str) -> None:
    for there, asked in ((one, other), (other, one)):
        study = tmp_path / there
        (study / root / f"sub-{there}" / f"ses-{there}").mkdir(parents=True)
        refuse_look_alikes(study, there, there)
        with pytest.raises(UsageError, match=f"sub-{asked} looks like sub-{there}") as refusal:
            refuse_look_alikes(study, asked, "99")
        assert f"write {there!r}" in str(refusal.value)
        with pytest.raises(UsageError, match=f"ses-{asked} looks like ses-{there}"):
            refuse_look_alikes(study, there, asked)


@pytest.mark.parametrize(("one", "other"), DIFFERENT)
def test_ids_that_differ_are_taken(tmp_path: Path, one: str, other: str) -> None:
    (tmp_path / f"sub-{one}" / f"ses-{one}").mkdir(parents=True)
    refuse_look_alikes(tmp_path, other, "01")
    refuse_look_alikes(tmp_path, one, other)


@given(number=st.integers(0, 10**6), other=st.integers(0, 10**6), zeros=st.integers(0, 5))
def test_numbers_look_alike_if_they_are_the_same_number(number: int, other: int, zeros: int) -> None:
    assert (look_alike(f"{'0' * zeros}{number}") == look_alike(str(other))) == (number == other)
    assert (look_alike(f"P{'0' * zeros}{number}x") == look_alike(f"p{other}X")) == (number == other)
