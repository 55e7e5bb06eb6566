"""The protocol's schema: what a YAML protocol may say.

Every quantity carries its unit in its key. Unknown keys are errors. The models are frozen: a protocol
does not change after it was loaded. What fields must be to each other is in `rules`, which loading asks.
"""

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from autd_trials.model import Model
from autd_trials.protocol.method import Method
from autd_trials.stimulus import Fraction, Limits, StimulusFields
from autd_trials.tables import spelled_levels

Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=40)]
Text = Annotated[str, Field(pattern=r"\S", max_length=10_000)]
Word = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_.+-]*$", max_length=40)]
Level = float | Word
"""A factor's level: a number (of a stimulus quantity) or a word (a condition that a person arranges)."""
LevelSentences = Annotated[dict[Annotated[str, Field(max_length=40)], Text], AfterValidator(spelled_levels)]
"""A sentence per level, by the level's one spelling: 5e-05 and 0.00005 are the same key."""
Coordinate = Annotated[float, Field(ge=-10_000, le=10_000)]


class Target(Model):
    """A point to focus on, in mm in the calibrated frame (unit 1's)."""

    x_mm: Coordinate = Field(description="To the right along unit 1, in mm.")
    y_mm: Coordinate = Field(description="Up along unit 1, in mm.")
    z_mm: Coordinate = Field(description="Away from unit 1, in mm.")


class StimulusSpec(StimulusFields):
    """One stimulus; every field can also be a factor."""

    target: Name = Field(description="Name of one of the protocol's targets.")


class Factor(Model):
    """A factor and its levels, in the order in which they are reported."""

    levels: tuple[Level, ...] = Field(
        min_length=1, max_length=50, description="The factor's levels: all numbers or all words."
    )
    describe: LevelSentences = Field(
        default_factory=dict,
        description="What each level is, shown and recorded (what the participant wears, say); of at most 32 "
        "characters each, they are the levels' names in figures and reports.",
    )


class Factors(Model):
    """What is varied: within a block from trial to trial, between blocks from block to block."""

    within_block: dict[Name, Factor] = Field(
        default_factory=dict,
        description="Fields of the stimulus that change from trial to trial.",
    )
    between_blocks: dict[Name, Factor] = Field(
        default_factory=dict,
        description="What changes from block to block: fields of the stimulus, or what a person arranges.",
    )


class Order(Model):
    """In which order blocks and trials come."""

    trials: Literal["shuffled", "fixed"] = Field(
        "shuffled", description="Shuffled anew in each block, or all kinds in turn as they are declared."
    )
    max_run_length: int | None = Field(
        None, ge=1, le=1000, description="Longest run of one kind of trial in a row."
    )
    max_run_of: Name | None = Field(
        None,
        description="Which factor (or trial_type) the run length counts; the whole condition if absent.",
    )
    blocks: Literal["balanced_latin_square", "shuffled", "fixed"] = Field(
        "balanced_latin_square",
        description="By a balanced Latin square over participants, shuffled, or as declared.",
    )


class Timing(Model):
    """When things happen, in s."""

    lead_in_s: float = Field(5.0, ge=0, le=600, description="From the start of a block to its first trial.")
    response_window_s: float = Field(gt=0, le=60, description="From the onset; a press in it means felt.")
    pause_min_s: float = Field(
        gt=0, le=600, description="Shortest pause from a window's end to the next onset."
    )
    pause_max_s: float = Field(gt=0, le=600, description="Longest pause; drawn evenly in between.")
    break_s: float = Field(0.0, ge=0, le=3600, description="Shortest break between blocks.")

    @property
    def pauses_us(self) -> tuple[int, int]:
        """The shortest and the longest pause in whole microseconds, as they are drawn."""
        return round(self.pause_min_s * 1e6), round(self.pause_max_s * 1e6)


class Masking(Model):
    """The sound that hides the array's own; exactly one of the two levels."""

    noise: Literal["pink"] = Field("pink", description="Pink noise: -10 dB per decade.")
    level_dbfs: float | None = Field(None, ge=-90, le=-15, description="RMS level re digital full scale.")
    level_dba: float | None = Field(
        None, ge=20, le=75, description="A-weighted level at the ear; needs the rig's headphones."
    )


class Response(Model):
    """What the participant is asked and how an answer is given."""

    question: Text = Field(description="What a press answers.")
    kind: Literal["yes_no"] = Field("yes_no", description="A press means yes, no press means no.")


class Safety(Limits):
    """Limits of this protocol; the rig's own limits hold as well."""

    largest_drive: Fraction = Field(1.0, description="Largest drive of any stimulus, 0 to 1.")


class Comparison(Model):
    """A planned comparison of two levels of a factor, at each level of another."""

    factor: Name = Field(description="The factor whose levels are compared.")
    first: Level = Field(description="The level that is compared.")
    second: Level = Field(description="The level that it is compared with.")
    at_each: Name | None = Field(None, description="Another factor: one comparison at each of its levels.")


class Study(Model):
    """Who did what under which approval; goes into the data set's description."""

    title: Text = Field(description="Title of the study.")
    authors: tuple[Text, ...] = Field(min_length=2, description="At least two, as data-set validators ask.")
    license: Text = Field("CC0-1.0", description="Licence of the data.")
    institution_name: Text = Field(description="Where the data are recorded.")
    institution_address: Text = Field(description="Its postal address.")
    department: Text = Field(description="The department in the institution.")
    ethics_approval: Text = Field(
        description="Id of the approval, or the words that none was needed and why."
    )


class Protocol(Model):
    """A whole study."""

    name: Annotated[str, Field(pattern=r"^[a-zA-Z0-9]+(-[a-zA-Z0-9]+)*$", max_length=60)] = Field(
        description="Name of the study's folder: letters, digits and hyphens."
    )
    description: Text = Field(description="What the study asks, in a sentence or two.")
    study: Study = Field(description="Who did what under which approval.")
    instructions: Text = Field(description="Read out to the participant before the first block.")
    targets: dict[Name, Target] = Field(
        min_length=1, max_length=100, description="Points to focus on, by name."
    )
    head: Target | None = Field(
        None,
        description="Middle between the participant's ears, for the level that reaches them; a real array "
        "needs it.",
    )
    stimulus: StimulusSpec = Field(description="The stimulus, where no factor says otherwise.")
    factors: Factors = Field(description="What is varied.")
    method: Method | None = Field(
        None,
        description="An adaptive method that chooses the level of one quantity; absent: constant stimuli.",
    )
    repetitions: int = Field(ge=1, le=1000, description="Stimuli of each kind in each block.")
    catch_trials_per_block: int = Field(0, ge=0, le=1000, description="Trials without a stimulus.")
    order: Order = Field(Order(), description="In which order blocks and trials come.")
    timing: Timing = Field(description="When things happen.")
    masking: Masking | None = Field(None, description="The sound that hides the array's own; none if absent.")
    response: Response = Field(description="What is asked and how an answer is given.")
    safety: Safety = Field(description="Limits that this protocol keeps.")
    comparisons: tuple[Comparison, ...] = Field(
        (), description="What the analysis compares, fixed beforehand."
    )

    @property
    def task(self) -> str:
        """The BIDS task label: the name without its hyphens."""
        return self.name.replace("-", "")

    def stimulus_for(self, conditions: Mapping[str, Level]) -> StimulusSpec:
        """Return the stimulus with the fields that conditions name replaced.

        What an adaptive method chooses stands at its largest level, unless conditions name it.

        Parameters
        ----------
        conditions
            Levels by factor; factors that are no field of the stimulus change nothing.

        Raises
        ------
        pydantic.ValidationError
            A level is none that its field allows.
        """
        fields = self.stimulus.model_dump()
        if self.method is not None:
            fields[self.method.varies] = self.method.range.largest
        return StimulusSpec.model_validate(
            fields | {key: conditions[key] for key in fields.keys() & conditions}
        )
