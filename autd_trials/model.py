"""The base of all models: whatever is read from a file, written to the log or handed from room to room."""

from pydantic import BaseModel, ConfigDict


class Model(BaseModel):
    """Frozen and strict: no unknown keys, no number written as text, no NaN and no infinity.

    A model says what each of its fields may be. What fields must be to each other is asked where a file is
    loaded (`autd_trials.protocol.rules`, say), so that a log stays readable when such a rule is tightened.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)
