from pathlib import Path

import pytest

from autd_trials.errors import UsageError
from autd_trials.records.layout import SessionPaths


def test_files_lie_where_the_contract_says() -> None:
    paths = SessionPaths(Path("data/chest"), "07", "02", "chest")
    assert (
        paths.log.as_posix() == "data/chest/sourcedata/sub-07/ses-02/sub-07_ses-02_task-chest_run-1_log.jsonl"
    )
    assert paths.events.as_posix() == "data/chest/sub-07/ses-02/beh/sub-07_ses-02_task-chest_run-1_events.tsv"


@pytest.mark.parametrize(
    "label",
    [
        "",
        "a b",
        "a-b",
        "a_b",
        "../x",
        "a/b",
        "a\\b",
        ".",
        "..",
        "é",
        "\uff11",
        "\u0663",
        "01\n",
        "a\0",
        "x" * 33,
        "sub-01",
        "*",
    ],
)
def test_ids_that_are_no_bids_labels_are_refused(label: str) -> None:
    with pytest.raises(UsageError, match="participant id") as refusal:
        SessionPaths(Path("data/chest"), label, "01", "chest")
    assert "letters A-Z, a-z and digits" in str(refusal.value)
    with pytest.raises(UsageError, match="session id"):
        SessionPaths(Path("data/chest"), "01", label, "chest")


@pytest.mark.parametrize("label", ["1", "01", "P07", "x" * 32, "CON"])
def test_bids_labels_are_taken(label: str) -> None:
    assert SessionPaths(Path("data/chest"), label, "01", "chest").log.parts[-3] == f"sub-{label}"
