"""Lab Streaming Layer for tests: heard on this machine only, and by nobody but this run of the tests."""

import os
import tempfile
from pathlib import Path
from uuid import uuid4


def keep_to_ourselves() -> None:
    """Set up this process and those that it starts; must come before the library is loaded."""
    path = Path(tempfile.mkdtemp(prefix="lsl-")) / "lsl_api.cfg"
    path.write_text(
        f"[lab]\nSessionID = tests-{uuid4().hex}\n[multicast]\nResolveScope = link\n[log]\nlevel = -3\n"
    )
    os.environ.setdefault("LSLAPICFG", str(path))
