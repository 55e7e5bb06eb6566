"""What all parts of a protocol have in common: frozen, strict models that check their fields together."""

from collections.abc import Iterator
from typing import Self

from pydantic import ValidationError, model_validator
from pydantic_core import InitErrorDetails

from autd_trials.model import Model as StrictModel


class Model(StrictModel):
    """Base of all protocol models: frozen, strict, no unknown keys, no NaN."""

    def faults(self) -> Iterator[InitErrorDetails]:
        """Yield what is wrong between the fields, located at the field to be mended."""
        yield from ()

    @model_validator(mode="after")
    def _refuse_faults(self) -> Self:
        if faults := list(self.faults()):
            raise ValidationError.from_exception_data(type(self).__name__, faults)
        return self
