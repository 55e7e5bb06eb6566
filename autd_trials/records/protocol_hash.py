"""The SHA-256 of a protocol as it is logged: of its content, so that it can be taken again from the log."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any


def protocol_sha256(protocol: Mapping[str, Any]) -> str:
    """Return the SHA-256, hexadecimal, of a resolved protocol as JSON with sorted keys and without blanks.

    Comments and layout of the YAML file, and the order of its keys, do not count. Logs of version 1 have
    the SHA-256 of the file instead.
    """
    text = json.dumps(protocol, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(text.encode("utf-8", errors="replace")).hexdigest()
