"""The protocol's schema: what a YAML protocol may say.

Every quantity carries its unit in its key. Unknown keys are errors. The models are frozen: a protocol
does not change after it was loaded.
"""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Waveform = Literal["sine", "square", "constant"]
ForceLaw = Literal["amplitude", "pressure"]
Level = float | str
"""A factor's level: a number (of a stimulus quantity) or a word (a condition that a person arranges)."""

Fraction = Annotated[float, Field(ge=0, le=1)]
Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=40)]


class Model(BaseModel):
    """Base of all protocol models: frozen, strict, no unknown keys, no NaN."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Target(Model):
    """A point to focus on, in mm in the calibrated frame (unit 1's)."""

    x_mm: float
    y_mm: float
    z_mm: float


class StimulusSpec(Model):
    """One stimulus; every field can also be a factor."""

    duration_s: float = Field(gt=0, le=16.0, description="Length of the burst in s.")
    modulation_hz: float = Field(gt=0, le=1000, description="Modulation frequency in Hz.")
    waveform: Waveform = Field("sine", description="Shape of the modulation.")
    depth: Fraction = Field(1.0, description="Modulation depth: 1 swings from full to zero.")
    drive: Fraction = Field(1.0, description="Peak pressure amplitude as a fraction of the array's largest.")
    force_law: ForceLaw = Field(
        "amplitude",
        description="What follows the waveform: the pressure amplitude, or the radiation pressure (its square).",
    )
    ramp_s: float = Field(0.005, ge=0, le=1.0, description="Raised-cosine ramp at both ends in s.")
    target: Name = Field(description="Name of one of the protocol's targets.")


class Factor(Model):
    """A factor and its levels, in the order in which they are reported."""

    levels: tuple[Level, ...] = Field(min_length=1, description="The factor's levels.")
    describe: dict[str, str] = Field(
        default_factory=dict, description="A sentence per level, shown and recorded (what the participant wears, say)."
    )


class Factors(Model):
    """What is varied: within a block from trial to trial, between blocks from block to block."""

    within_block: dict[Name, Factor] = Field(default_factory=dict)
    between_blocks: dict[Name, Factor] = Field(default_factory=dict)


class Order(Model):
    """In which order blocks and trials come."""

    trials: Literal["shuffled", "fixed"] = "shuffled"
    max_run_length: int | None = Field(None, ge=1, description="Longest run of one kind of trial in a row.")
    max_run_of: Name | None = Field(
        None, description="Which factor (or trial_type) the run length counts; the whole condition if absent."
    )
    blocks: Literal["balanced_latin_square", "shuffled", "fixed"] = "balanced_latin_square"


class Timing(Model):
    """When things happen, in s."""

    lead_in_s: float = Field(5.0, ge=0, le=600, description="From the start of a block to its first trial.")
    response_window_s: float = Field(gt=0, le=60, description="From the onset; a press in it means felt.")
    pause_min_s: float = Field(gt=0, le=600, description="Shortest pause from a window's end to the next onset.")
    pause_max_s: float = Field(gt=0, le=600, description="Longest pause; drawn evenly in between.")
    break_s: float = Field(0.0, ge=0, le=3600, description="Shortest break between blocks.")


class Masking(Model):
    """The sound that hides the array's own; exactly one of the two levels."""

    noise: Literal["pink"] = "pink"
    level_dbfs: float | None = Field(None, ge=-90, le=-15, description="RMS level re digital full scale.")
    level_dba: float | None = Field(None, ge=20, le=75, description="A-weighted level at the ear; needs the rig's headphones.")


class Response(Model):
    """What the participant is asked and how an answer is given."""

    question: str = Field(min_length=1, description="What a press answers.")
    kind: Literal["yes_no"] = "yes_no"


class Safety(Model):
    """Limits of this protocol; the rig's own limits hold as well."""

    largest_drive: Fraction = 1.0
    longest_burst_s: float = Field(gt=0, le=16.0)
    largest_duty: float = Field(gt=0, le=1, description="Largest share of on-time in any 60 s.")
    session_exposure_s: float = Field(gt=0, description="Largest sum of drive^2 x duration in a session, in s at full drive.")


class Comparison(Model):
    """A planned comparison of two levels of a factor, at each level of another."""

    factor: Name
    first: Level
    second: Level
    at_each: Name | None = None


class Study(Model):
    """Who did what under which approval; goes into the data set's description."""

    title: str
    authors: tuple[str, ...] = Field(min_length=2, description="At least two, as data-set validators ask.")
    license: str = "CC0-1.0"
    institution_name: str
    institution_address: str
    department: str
    ethics_approval: str = Field(description="Id of the approval, or the words that none was needed and why.")


class Protocol(Model):
    """A whole study."""

    name: Annotated[str, Field(pattern=r"^[a-zA-Z0-9]+(-[a-zA-Z0-9]+)*$", max_length=60)]
    description: str = Field(min_length=1)
    study: Study
    instructions: str = Field(min_length=1, description="Read out to the participant before the first block.")
    targets: dict[Name, Target] = Field(min_length=1)
    stimulus: StimulusSpec
    factors: Factors
    repetitions: int = Field(ge=1, le=1000, description="Stimuli of each kind in each block.")
    catch_trials_per_block: int = Field(0, ge=0, le=1000, description="Trials without a stimulus.")
    order: Order = Order()
    timing: Timing
    masking: Masking | None = None
    response: Response
    safety: Safety
    comparisons: tuple[Comparison, ...] = ()

    @property
    def task(self) -> str:
        """The BIDS task label: the name without its hyphens."""
        return self.name.replace("-", "")
