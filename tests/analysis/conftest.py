"""A small writer of synthetic studies in the runner's file layout; no random numbers unless asked for."""

import hashlib
import itertools
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from autd_trials.protocol.plan import Plan, PlannedBlock, PlannedTrial
from autd_trials.protocol.schema import (
    Comparison,
    Factor,
    Factors,
    Level,
    Protocol,
    Response,
    Safety,
    StimulusSpec,
    Study,
    Target,
    Timing,
)
from autd_trials.session.events import SessionEnd, SessionStart

Answer = Callable[[Mapping[str, Level | None], int], bool | None]
"""Whether a trial was felt, from its conditions and its repetition (from 0); None is no answer."""

FREQUENCIES: tuple[Level, ...] = (25.0, 50.0, 100.0)
CLOTHING: tuple[Level, ...] = ("inner", "inner_outer")
COLUMNS = ("onset", "duration", "trial_type", "trial", "block", "attempt", "trial_status")


def chest_protocol(
    *,
    within: Mapping[str, Sequence[Level]] | None = None,
    between: Mapping[str, Sequence[Level]] | None = None,
    comparisons: tuple[Comparison, ...] | None = None,
    repetitions: int = 10,
    catch_trials: int = 0,
    name: str = "chest",
) -> Protocol:
    """Return a protocol like the paper's, with the given factors."""
    within = {"modulation_hz": FREQUENCIES} if within is None else within
    between = {"clothing": CLOTHING} if between is None else between
    planned = Comparison(factor="clothing", first="inner", second="inner_outer", at_each="modulation_hz")
    return Protocol(
        name=name,
        description="A synthetic study for tests.",
        study=Study(
            title="Test",
            authors=("A", "B"),
            institution_name="I",
            institution_address="A",
            department="D",
            ethics_approval="none needed: no people",
        ),
        instructions="Press when you feel something.",
        targets={"chest": Target(x_mm=0.0, y_mm=0.0, z_mm=1000.0)},
        stimulus=StimulusSpec(duration_s=1.0, modulation_hz=100.0, target="chest"),
        factors=Factors(
            within_block={key: Factor(levels=tuple(levels)) for key, levels in within.items()},
            between_blocks={key: Factor(levels=tuple(levels)) for key, levels in between.items()},
        ),
        repetitions=repetitions,
        catch_trials_per_block=catch_trials,
        timing=Timing(response_window_s=2.5, pause_min_s=1.5, pause_max_s=2.5),
        response=Response(question="Did you feel it?"),
        safety=Safety(longest_burst_s=1.0, largest_duty=0.5, session_exposure_s=10_000.0),
        comparisons=(planned,) if comparisons is None else comparisons,
    )


def plan_in_order(protocol: Protocol, place: int) -> Plan:
    """Return a plan in plain order: all repetitions of a condition, then the next, then catch trials."""
    blocks: list[PlannedBlock] = []
    trials: list[PlannedTrial] = []
    for number, levels in enumerate(_crossed(protocol.factors.between_blocks), start=1):
        blocks.append(PlannedBlock(block=number, conditions=levels, descriptions=()))
        kinds: list[tuple[str, dict[str, Level | None]]] = [
            ("stimulus", {**within, **levels})
            for within in _crossed(protocol.factors.within_block)
            for _ in range(protocol.repetitions)
        ]
        kinds += [
            ("catch", {**dict.fromkeys(protocol.factors.within_block), **levels})
        ] * protocol.catch_trials_per_block
        trials += [
            PlannedTrial(
                trial=len(trials) + place_in_block,
                block=number,
                trial_type="catch" if kind == "catch" else "stimulus",
                conditions=conditions,
                stimulus=protocol.stimulus,
                pause_before_s=2.0,
            )
            for place_in_block, (kind, conditions) in enumerate(kinds, start=1)
        ]
    return Plan(
        protocol=protocol.name, place=place, session=1, seed=1, blocks=tuple(blocks), trials=tuple(trials)
    )


def _crossed(factors: Mapping[str, Factor]) -> list[dict[str, Level]]:
    return [
        dict(zip(factors, levels, strict=True))
        for levels in itertools.product(*(factor.levels for factor in factors.values()))
    ]


@dataclass
class StudyWriter:
    """Writes sessions into one study folder."""

    folder: Path
    protocol: Protocol = field(default_factory=chest_protocol)

    def add(
        self,
        participant: str,
        answer: Answer,
        *,
        session: str = "01",
        simulated: bool = True,
        status: str | None = "success",
        trials: int | None = None,
        interrupted: Sequence[int] = (),
        utc: str = "2026-01-01T10:00:00+00:00",
    ) -> Path:
        """Write one session's log and trial table (its first `trials` trials); return the table."""
        plan = plan_in_order(self.protocol, place=int(participant))
        self._write_log(plan, participant, session, simulated, status, utc)
        rows = [self._header()]
        seen: dict[str, int] = {}
        for trial in plan.trials[:trials]:
            key = json.dumps([trial.trial_type, trial.conditions])
            repetition = seen.setdefault(key, 0)
            seen[key] += 1
            if trial.trial in interrupted:
                rows.append(self._row(trial, 1, "interrupted", None))
            attempt = 2 if trial.trial in interrupted else 1
            rows.append(self._row(trial, attempt, "complete", answer(trial.conditions, repetition)))
        table = self._path("", participant, session) / "beh" / f"{self.stem(participant, session)}_events.tsv"
        table.parent.mkdir(parents=True)
        table.write_text("\n".join(rows) + "\n", encoding="utf-8")
        return table

    def stem(self, participant: str, session: str = "01") -> str:
        """Return what the names of a session's files begin with."""
        return f"sub-{participant}_ses-{session}_task-{self.protocol.task}_run-1"

    def log(self, participant: str, session: str = "01") -> Path:
        """Return the path of a session's log."""
        folder = self._path("sourcedata", participant, session)
        return folder / f"{self.stem(participant, session)}_log.jsonl"

    def _path(self, root: str, participant: str, session: str) -> Path:
        return self.folder / root / f"sub-{participant}" / f"ses-{session}"

    def _write_log(
        self, plan: Plan, participant: str, session: str, simulated: bool, status: str | None, utc: str
    ) -> None:
        start = SessionStart(
            t_s=0.0,
            utc=utc,
            participant=participant,
            session=session,
            simulated=simulated,
            virtual_time=simulated,
            protocol=self.protocol,
            protocol_sha256=hashlib.sha256(self.protocol.model_dump_json().encode()).hexdigest(),
            plan=plan,
            rig={},
            calibration={},
            calibration_sha256="0" * 64,
            devices={},
            versions={},
            git_commit=None,
        )
        lines = [start.model_dump_json()]
        if status is not None:
            end = {"event": "session-end", "t_s": 100.0, "utc": utc, "status": status, "why": "test"}
            lines.append(SessionEnd.model_validate(end).model_dump_json())
        log = self.log(participant, session)
        log.parent.mkdir(parents=True)
        log.write_text("\n".join(lines) + "\n", encoding="utf-8")

    def _factors(self) -> list[str]:
        return [*self.protocol.factors.within_block, *self.protocol.factors.between_blocks]

    def _header(self) -> str:
        return "\t".join([*COLUMNS, *self._factors(), "response", "response_time", "onset_lateness"])

    def _row(self, trial: PlannedTrial, attempt: int, status: str, felt: bool | None) -> str:
        levels = [trial.conditions[name] for name in self._factors()]
        response = {True: "felt", False: "not_felt", None: "n/a"}[felt]
        cells = [
            f"{5.0 * trial.trial + attempt}",
            "1",
            trial.trial_type,
            f"{trial.trial}",
            f"{trial.block}",
            f"{attempt}",
            status,
            *("n/a" if level is None else f"{level}" for level in levels),
            response,
            f"0.{400 + trial.trial}" if felt else "n/a",
            "0",
        ]
        return "\t".join(cells)


@pytest.fixture
def writer(tmp_path: Path) -> StudyWriter:
    """Return a writer of a chest study into an empty folder."""
    return StudyWriter(tmp_path / "chest")


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
    cells: list[tuple[Level | None, ...]] = [(wear, hz) for wear in CLOTHING for hz in FREQUENCIES]
    return felt_first(dict(zip(cells, counts, strict=True)), ("clothing", "modulation_hz"))


def chest_study(folder: Path) -> StudyWriter:
    """Write a study of eight participants with `CHEST_COUNTS`."""
    writer = StudyWriter(folder)
    for number, counts in enumerate(CHEST_COUNTS, start=1):
        writer.add(f"{number:02}", chest_answer(counts))
    return writer


@pytest.fixture
def chest(tmp_path: Path) -> StudyWriter:
    """Return a written study of eight participants with `CHEST_COUNTS`."""
    return chest_study(tmp_path / "chest")
