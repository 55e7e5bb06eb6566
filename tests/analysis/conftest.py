"""The chest study: eight participants whose answers are known, recorded as the runner records."""

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from autd_trials.protocol.schema import Comparison, Level, Protocol, Safety, Timing
from autd_trials.testing.recorded import Answer, StudyWriter
from autd_trials.testing.studies import CLOTHING, FREQUENCIES_HZ, make_protocol


def chest_protocol(
    *,
    within: Mapping[str, Sequence[Level]] | None = None,
    between: Mapping[str, Sequence[Level]] | None = None,
    comparisons: tuple[Comparison, ...] | None = None,
    repetitions: int = 10,
    catch_trials: int = 0,
    **changes: Any,
) -> Protocol:
    """Return a protocol like the paper's, with the given factors."""
    planned = Comparison(factor="clothing", first="inner", second="inner_outer", at_each="modulation_hz")
    return make_protocol(
        "chest",
        within=within,
        between=between,
        repetitions=repetitions,
        catch_trials_per_block=catch_trials,
        timing=Timing(response_window_s=2.5, pause_min_s=1.5, pause_max_s=2.5),
        safety=Safety(longest_burst_s=1.0, largest_duty=0.5, session_exposure_s=1000.0),
        comparisons=(planned,) if comparisons is None else comparisons,
        masking=None,
        **changes,
    )


@pytest.fixture
def writer(tmp_path: Path) -> StudyWriter:
    """Return a writer of a chest study into an empty folder."""
    return StudyWriter(tmp_path / "chest", chest_protocol())


def felt_first(counts: Mapping[tuple[Level | None, ...], int], factors: Sequence[str]) -> Answer:
    """Return answers that give each condition its count: its first so many repetitions are felt.

    Catch trials are looked up by the levels they have, None where they have none.
    """

    def answer(conditions: Mapping[str, Level | None], repetition: int) -> bool:
        return repetition < counts[tuple(conditions[name] for name in factors)]

    return answer


CHEST_COUNTS: tuple[tuple[int, int, int, int, int, int], ...] = (
    (5, 8, 10, 1, 2, 3),
    (3, 7, 10, 0, 1, 4),
    (6, 9, 10, 3, 4, 7),
    (4, 6, 9, 1, 1, 2),
    (8, 10, 10, 4, 6, 9),
    (2, 5, 9, 0, 0, 1),
    (7, 9, 10, 2, 3, 5),
    (6, 8, 9, 2, 4, 6),
)
"""Felt of 10 for eight participants: inner 25, 50, 100 Hz, then inner_outer 25, 50, 100 Hz."""


def chest_answer(counts: Sequence[int]) -> Answer:
    """Return answers for one row of `CHEST_COUNTS`."""
    cells: list[tuple[Level | None, ...]] = [(wear, hz) for wear in CLOTHING for hz in FREQUENCIES_HZ]
    return felt_first(dict(zip(cells, counts, strict=True)), ("clothing", "modulation_hz"))


@pytest.fixture(scope="session")
def recorded_chest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a study of eight participants with `CHEST_COUNTS`, recorded once, to be copied."""
    writer = StudyWriter(tmp_path_factory.mktemp("recorded") / "chest", chest_protocol())
    for number, counts in enumerate(CHEST_COUNTS, start=1):
        writer.add(f"{number:02}", chest_answer(counts))
    return writer.folder


@pytest.fixture
def chest(writer: StudyWriter, recorded_chest: Path) -> StudyWriter:
    """Return a copy of `recorded_chest`."""
    shutil.copytree(recorded_chest, writer.path)
    return writer
