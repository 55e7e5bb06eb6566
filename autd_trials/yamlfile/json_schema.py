"""A file's schema for editors."""

from typing import Any

from pydantic import BaseModel

_DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema(model: type[BaseModel]) -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of the files that a model reads.

    It says what each key may be. What keys must be to each other (that a comparison's levels exist, say) only
    loading the file can tell.
    """
    schema = model.model_json_schema()
    return {"$schema": _DIALECT, **schema, "title": f"autd_trials {model.__name__.lower()}"}
