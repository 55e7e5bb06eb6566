"""What all parts of a protocol have in common: frozen, strict models that check their fields together."""

from collections.abc import Iterator
from typing import Annotated, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic_core import InitErrorDetails

Fraction = Annotated[float, Field(ge=0, le=1)]


class Model(BaseModel):
    """Base of all protocol models: frozen, strict, no unknown keys, no NaN."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    def faults(self) -> Iterator[InitErrorDetails]:
        """Yield what is wrong between the fields, located at the field to be mended."""
        yield from ()

    @model_validator(mode="after")
    def _refuse_faults(self) -> Self:
        if faults := list(self.faults()):
            raise ValidationError.from_exception_data(type(self).__name__, faults)
        return self
