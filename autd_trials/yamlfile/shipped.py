"""Finding a YAML file by its path or, if it comes with the package, by its bare name."""

from importlib import resources
from pathlib import Path

from autd_trials.errors import UsageError
from autd_trials.yamlfile.suggest import did_you_mean

_SUFFIX = ".yaml"


def find_file(name_or_path: str, *, kind: str, folder: str = "") -> Path:
    """Return the file that a person means.

    Parameters
    ----------
    name_or_path
        The path of a file, or the bare name of a shipped one with or without ``.yaml``. A file of that name
        in the current folder goes first.
    kind
        What it is called in messages.
    folder
        Below the shipped protocols, where the shipped ones of its kind lie.

    Raises
    ------
    UsageError
        There is neither such a file nor such a shipped one.
    """
    path = Path(name_or_path)
    if name_or_path and is_file(path):
        return path
    shipped = shipped_names(folder)
    if name_or_path.removesuffix(_SUFFIX) in shipped:
        return _shipped(folder) / f"{name_or_path.removesuffix(_SUFFIX)}{_SUFFIX}"
    raise UsageError(
        f"there is no {kind} {name_or_path!r}{did_you_mean(path.stem, shipped)}",
        do=f"give the path of a YAML file, or one of the shipped names: {', '.join(shipped)}",
    )


def shipped_names(folder: str = "") -> list[str]:
    """Return the names of the shipped YAML files in a folder below the protocols, sorted."""
    return sorted(path.stem for path in _shipped(folder).glob(f"*{_SUFFIX}"))


def is_file(path: Path) -> bool:
    """Tell whether there is such a file; a name that is too long, or holds a NUL, is no file's."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def _shipped(folder: str) -> Path:
    return Path(str(resources.files("autd_trials"))) / "protocols" / folder
