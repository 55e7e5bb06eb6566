"""What was varied in a study and what was planned to be compared, from its sessions' protocols."""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from autd_analysis.data.sessions import LoggedSession
from autd_trials.errors import UsageError
from autd_trials.protocol.method import Method
from autd_trials.protocol.schema import Comparison, Factor, Level, Protocol, Study
from autd_trials.tables import RESERVED_NAMES, level_text, number

Condition = tuple[tuple[str, Level], ...]
"""Factors and the level that each has, in the study's order of factors."""


@dataclass(frozen=True)
class StudyFactor:
    """A factor as the analysis sees it.

    Attributes
    ----------
    name
        Its name, with the unit: ``modulation_hz``.
    levels
        Its levels in the order in which they are reported.
    describe
        A sentence per level, where the protocol has one.
    within_block
        Whether it varies within a block (then catch trials do not have it) or between blocks.
    title
        What figures and texts call it, where a person said so.
    labels
        What they call its levels, likewise.
    """

    name: str
    levels: tuple[Level, ...]
    describe: dict[str, str]
    within_block: bool
    title: str | None = None
    labels: Mapping[Level, str] = field(default_factory=dict)

    def parse(self, text: str) -> Level | None:
        """Return the level that a table's cell means; None if it is none of the factor's."""
        value = number(text)
        return next((level for level in self.levels if level in (text, value)), None)


@dataclass(frozen=True)
class Design:
    """A study's factors, those within blocks first, its planned comparisons, and whose it is, where known.

    With an adaptive `method` the level of one more quantity was chosen from the answers before.
    """

    protocol: str
    study: Study | None
    factors: tuple[StudyFactor, ...]
    comparisons: tuple[Comparison, ...]
    method: Method | None = None

    @property
    def between_blocks(self) -> tuple[StudyFactor, ...]:
        """The factors that catch trials have too."""
        return tuple(factor for factor in self.factors if not factor.within_block)

    def factor(self, name: str) -> StudyFactor:
        """Return the factor of that name; raises KeyError."""
        return {factor.name: factor for factor in self.factors}[name]


def conditions(factors: Sequence[StudyFactor]) -> tuple[Condition, ...]:
    """Return all combinations of the factors' levels, in order; one empty condition without factors."""
    axes = [[(factor.name, level) for level in factor.levels] for factor in factors]
    return tuple(itertools.product(*axes))


def describe_condition(condition: Condition) -> str:
    """Return a condition in words, as in ``modulation_hz 25, clothing inner``."""
    return ", ".join(f"{name} {level_text(level)}" for name, level in condition) or "overall"


def study_design(sessions: Sequence[LoggedSession]) -> Design:
    """Return the design of a study.

    The newest session's protocol gives the comparisons and the order of the levels; levels that only older
    sessions had come after them.

    Parameters
    ----------
    sessions
        The study's sessions, at least one.

    Raises
    ------
    UsageError
        The sessions were not recorded with the same factors.
    """
    newest_first = sorted(sessions, key=lambda session: (session.start.utc, session.name), reverse=True)
    newest = newest_first[0].start.protocol
    _require_same_factors(newest_first)
    refuse_reserved(_factors(newest), str(newest_first[0].log), "rename the factor in a copy of the study")
    factors = tuple(_study_factor(name, newest_first) for name in _factors(newest))
    return Design(newest.name, newest.study, factors, newest.comparisons, newest.method)


def refuse_reserved(names: Iterable[str], where: str, do: str) -> None:
    """Raise UsageError if a factor is called as a column that tables put beside it."""
    clash = [name for name in names if name in RESERVED_NAMES]
    if clash:
        raise UsageError(
            f"a factor is called {', '.join(clash)}, as is a column of the tables", where=where, do=do
        )


def protocol_design(protocol: Protocol) -> Design:
    """Return the design of studies that a protocol plans."""
    within = protocol.factors.within_block
    factors = tuple(
        StudyFactor(name, tuple(factor.levels), dict(factor.describe), name in within)
        for name, factor in _factors(protocol).items()
    )
    return Design(protocol.name, protocol.study, factors, protocol.comparisons, protocol.method)


def _factors(protocol: Protocol) -> dict[str, Factor]:
    return protocol.factors.within_block | protocol.factors.between_blocks


def _study_factor(name: str, newest_first: Sequence[LoggedSession]) -> StudyFactor:
    within_block = name in newest_first[0].start.protocol.factors.within_block
    versions = [_factors(session.start.protocol)[name] for session in newest_first]
    describe: dict[str, str] = {}
    for version in reversed(versions):
        describe |= version.describe
    levels = dict.fromkeys(level for version in versions for level in version.levels)
    return StudyFactor(name, tuple(levels), describe, within_block)


def _require_same_factors(newest_first: Sequence[LoggedSession]) -> None:
    newest = newest_first[0]
    for other in newest_first[1:]:
        if _shape(other.start.protocol) != _shape(newest.start.protocol):
            raise UsageError(
                "the sessions were recorded with protocols of different factors or methods:\n"
                f"  {_shape(newest.start.protocol)} in {newest.log}\n"
                f"  {_shape(other.start.protocol)} in {other.log}",
                do="keep sessions of different protocols in different study folders and analyse each",
            )


def _shape(protocol: Protocol) -> str:
    within, between = (
        ", ".join(sorted(names)) or "none"
        for names in (protocol.factors.within_block, protocol.factors.between_blocks)
    )
    method = f"; method: {protocol.method.model_dump(mode='json')}" if protocol.method else ""
    return f"within blocks: {within}; between blocks: {between}{method}"
