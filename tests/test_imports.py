"""No module needs itself, on whatever way: also not for its types only, and not within a function."""

import ast
from collections.abc import Iterator
from pathlib import Path

import autd_analysis
import pytest

import autd_trials

PACKAGES = [Path(each) for package in (autd_trials, autd_analysis) for each in package.__path__]


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.name)
def test_no_import_goes_round_in_a_circle(package: Path) -> None:
    modules = {name(path, package): path for path in package.rglob("*.py")}
    needs = {module: set(imported(path, package)) & set(modules) for module, path in modules.items()}
    assert len(needs) > 60, "all modules are looked at"
    while free := [module for module, needed in needs.items() if not needed]:
        for module in free:
            del needs[module]
        for needed in needs.values():
            needed.difference_update(free)
    assert not needs, f"these import each other, or what does: {sorted(needs)}"


def name(path: Path, package: Path) -> str:
    parts = path.relative_to(package.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported(path: Path, package: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            named = [f"{node.module}.{alias.name}" for alias in node.names]
            modules = [each for each in named if is_module(each, package)]
            yield from modules
            if len(modules) < len(named):  # a package's own face imports nothing until it is asked
                yield node.module


def is_module(name: str, package: Path) -> bool:
    path = package.parent.joinpath(*name.split("."))
    return path.with_suffix(".py").is_file() or (path / "__init__.py").is_file()
