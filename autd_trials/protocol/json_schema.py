"""The protocol's schema for editors."""

from typing import Any

from autd_trials.protocol.schema import Protocol

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a protocol file.

    It says what each key may be. What keys must be to each other (that a comparison's levels exist, say) only
    loading the protocol can tell.
    """
    return {
        "$schema": DIALECT,
        **Protocol.model_json_schema(),
        "title": "autd_trials protocol",
        "description": "A study with a midair haptic display: what is presented to whom, in which order.",
    }
