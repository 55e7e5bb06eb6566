"""Each room names its public face, which costs nothing until it is used."""

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import autd_trials

HERE = Path(autd_trials.__file__).parent
HEAVY = ("numpy", "scipy", "pandas", "autd3", "numba", "matplotlib", "rich", "sounddevice", "serial")
ROOMS = sorted(
    folder.name
    for folder in HERE.iterdir()
    if (folder / "__init__.py").is_file() and folder.name != "commands"  # its face is the command line
)


def names_in_source(room: str) -> list[str]:
    tree = ast.parse((HERE / room / "__init__.py").read_text(encoding="utf-8"))
    (names,) = [
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", None) == "__all__"
    ]
    return list(names)


def _in_order(name: str) -> tuple[int, str]:
    """Constants, classes, functions."""
    return 0 if name.isupper() else 1 if name[0].isupper() else 2, name


def test_there_are_rooms() -> None:
    assert {"protocol", "array", "session", "records", "responses", "testing"} <= set(ROOMS)


@pytest.mark.parametrize("room", ROOMS)
def test_every_name_of_a_face_is_there(room: str) -> None:
    names = names_in_source(room)
    assert names
    assert len(names) == len(set(names))
    assert names == sorted(names, key=_in_order)
    module = importlib.import_module(f"autd_trials.{room}")
    for name in names:
        found = getattr(module, name)
        assert not isinstance(found, type(module)), f"{room}.{name} is a module, not what it should be"
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = module.nothing


def test_looking_at_all_faces_imports_nothing_heavy() -> None:
    program = "import sys\n" + "".join(f"import autd_trials.{room}\n" for room in ROOMS)
    program += f"print(*(name for name in {HEAVY!r} if name in sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
