import hashlib
from pathlib import Path
from typing import Annotated, Literal

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import BaseModel, ConfigDict, Field

from autd_trials.errors import UsageError
from autd_trials.yamlfile import did_you_mean, load_model, load_with_sha256
from autd_trials.yamlfile.tree import MOST_EVENTS


@pytest.fixture(params=["CSafeLoader", "SafeLoader"])
def either_parser(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Read by libyaml, and by what stands in where it is missing."""
    monkeypatch.setattr("autd_trials.yamlfile.tree._Loader", getattr(yaml, request.param))


class Lamp(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    colour: Literal["red", "green", "blue"]
    brightness: Annotated[float, Field(ge=0, le=1)]
    hours: tuple[int, ...] = ()


class House(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    name: str
    lamps: dict[str, Lamp]
    open: bool = False


GOOD = """\
name: home
lamps:
  hall: {colour: red, brightness: 0.5}
  attic:
    colour: blue
    brightness: 1
    hours: [7, 20]
"""


def write(folder: Path, text: str | bytes) -> Path:
    path = folder / "house.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def refusal(folder: Path, text: str | bytes) -> list[str]:
    """The lines of the refusal, without the file's name."""
    path = write(folder, text)
    with pytest.raises(UsageError) as caught:
        load_model(path, House)
    assert caught.value.exit_code == 2
    return [line.removeprefix(f"{path}:") for line in str(caught.value).splitlines()]


@pytest.mark.usefixtures("either_parser")
def test_a_good_file_is_read_with_the_hash_of_its_bytes(tmp_path: Path) -> None:
    house, sha256 = load_with_sha256(write(tmp_path, GOOD), House)
    assert house.lamps["attic"] == Lamp(colour="blue", brightness=1.0, hours=(7, 20))
    assert sha256 == hashlib.sha256(GOOD.encode()).hexdigest()


def test_a_byte_order_mark_and_windows_line_ends_do_not_matter(tmp_path: Path) -> None:
    plain = load_model(write(tmp_path, GOOD), House)
    assert load_model(write(tmp_path, b"\xef\xbb\xbf" + GOOD.encode()), House) == plain
    assert load_model(write(tmp_path, GOOD.replace("\n", "\r\n")), House) == plain


@pytest.mark.usefixtures("either_parser")
def test_all_problems_are_told_at_once_in_the_order_of_the_file(tmp_path: Path) -> None:
    text = (
        "nam: home\nlamps:\n  hall: {colour: redd, brightness: 2}\n  attic:\n    colour: blue\nopen: maybe\n"
    )
    assert refusal(tmp_path, text) == [
        "1:1: name: this key is missing; add it",
        "1:1: nam: unknown key; allowed: lamps, name, open; did you mean 'name'?",
        "3:18: lamps.hall.colour: is 'redd'; allowed: 'red', 'green' or 'blue'; did you mean 'red'?",
        "3:36: lamps.hall.brightness: is 2; allowed: a number less than or equal to 1",
        "4:3: lamps.attic.brightness: this key is missing; add it",
        "6:7: open: is 'maybe'; allowed: true or false",
    ]


@pytest.mark.usefixtures("either_parser")
@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "1:1: the file is empty"),
        ("# only a note\n", "1:1: the file is empty"),
        ("- a\n- b\n", "1:1: is a list of 2; allowed: a mapping"),
        ("name: a\nname: b\nlamps: {}\n", "2:1: name: this key was given already in line 1"),
        ("name: home\n\tlamps: {}\n", "2:1: a tab stands here; indent with spaces"),
        ("name: &n home\nlamps: {}\nopen: *n\n", "1:7: name: anchors (&) are not allowed"),
        ("name: !!python/object:os.system home\nlamps: {}\n", "1:7: name: tags (!) are not allowed"),
        ("name: a\nlamps: {}\n---\nname: b\n", "3:1: a second document starts here"),
        ("name: a\nlamps: {hall: {colour: red, brightness: .nan}}\n", "put it in quotes"),
        ("name: a\nlamps: {hall: {colour: red, brightness: 1e999}}\n", "this number is too large"),
        (
            "name: a\nlamps: {hall: {colour: no, brightness: 1}}\n",
            "'no' is true or false to some YAML readers",
        ),
        ("name: 2026-11-22\nlamps: {}\n", "'2026-11-22' is a date to some YAML readers"),
        ("name: [a\nlamps: {}\n", "not YAML"),
        ("name: a\nlamps: {hall: [1, 2]}\n", "lamps.hall: is a list of 2; allowed: a mapping"),
        ("name: 'a\x07'\nlamps: {}\n", "may not stand in a YAML file"),
        ('name: "a\\u0007"\nlamps: {}\n', "contains the control character U+0007"),
        ("name: a\nlamps: " + "[" * 40 + "]" * 40 + "\n", "nested more than 20 levels deep"),
        (
            "name: a\nlamps: {hall: {colour: red, brightness: 1, hours: [1, two]}}\n",
            "lamps.hall.hours[1]: is 'two'",
        ),
        ("? [a, b]\n: 1\n", "a key must be a word"),
        (b"name: \xff\xfe\nlamps: {}\n", "1:7: this is not UTF-8 text"),
    ],
)
def test_each_mistake_has_its_message_and_place(tmp_path: Path, text: str | bytes, expected: str) -> None:
    assert any(expected in line for line in refusal(tmp_path, text)), refusal(tmp_path, text)


def test_a_billion_laughs_stay_few(tmp_path: Path) -> None:
    text = "name: &a [x, x]\n" + "".join(
        f"k{n}: &b{n} [*a, *a, *a, *a, *a, *a, *a, *a, *a]\n" for n in range(9)
    )
    assert any("anchors" in line for line in refusal(tmp_path, text))


def test_more_than_a_hundred_problems_are_counted(tmp_path: Path) -> None:
    text = GOOD + "".join(f"extra{number}: 1\n" for number in range(130))
    lines = refusal(tmp_path, text)
    assert len(lines) == 101
    assert lines[-1].endswith("and 30 more")


def test_what_is_no_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="there is no such file"):
        load_model(tmp_path / "none.yaml", House)
    with pytest.raises(UsageError, match="this is not a file"):
        load_model(tmp_path, House)
    with pytest.raises(UsageError, match="larger than 1 MB"):
        load_model(write(tmp_path, b"#" * 1_000_001), House)


PIECES = [
    *(
        "? ",
        ": ",
        "- ",
        "[",
        "]",
        "{",
        "}",
        ", ",
        "\n",
        "\n  ",
        "\t",
        "#",
        "'",
        '"',
        "|\n",
        ">-\n",
        "---\n",
        "...\n",
    ),
    *(
        "&a ",
        "*a ",
        "!!int ",
        "! ",
        "<<: ",
        "%YAML 1.1\n",
        "name",
        "lamps",
        "colour",
        "red",
        "hours",
        "open",
        "true",
    ),
    *(
        "no",
        "0o7",
        "1_000",
        "1:30",
        "2026-11-22",
        "0001-01-01",
        "9999-12-31T23:59:59Z",
        ".inf",
        "1e999",
        "9" * 400,
    ),
    *("\\ud800", "\\0", "\ufeff", "\u2028", "\u202e", "\x85", "\U0001f4a5", "~", "=", "@", "`"),
]
BOMBS = {
    "keys": "".join(f"extra{number}: 1\n" for number in range(90_000)),
    "items": "lamps: [" + "1," * 450_000 + "]\n",
    "question marks": "? " * 450_000,
    "dashes": "- " * 450_000,
    "brackets": "[" * 900_000,
    "braces": "{" * 900_000,
    "anchors": "- &a\n" * 150_000,
    "aliases": "- *a\n" * 150_000,
    "one key": "a: 1\n" * 180_000,
    "tabs": "\t" * 900_000,
    "documents": "---\n" * 200_000,
    "directives": "%a b\n" * 150_000,
}


@pytest.mark.parametrize("name", BOMBS)
def test_a_bomb_is_refused_long_before_its_end(tmp_path: Path, name: str) -> None:
    assert len(refusal(tmp_path, BOMBS[name])) == 1


def test_what_is_wrong_is_explained_a_hundred_times_and_counted_to_the_end(tmp_path: Path) -> None:
    """Explaining takes time: it is done once for each line shown, by a schema that is made once."""
    keys = MOST_EVENTS // 2 - 50
    lines = refusal(tmp_path, GOOD + "".join(f"extra{number}: 1\n" for number in range(keys)))
    assert len(lines) == 101
    assert lines[-1] == f" and {keys - 100} more"


@pytest.mark.usefixtures("either_parser")
@pytest.mark.parametrize(
    "text",
    ["? ? ? a\n", "? ? ?\n", "? - ? - a\n: b\n", "[? [a, b]: c, ? {x: y}]\n", "? &a [*a, *a]\n: *a\n"],
)
def test_keys_of_keys_are_told(tmp_path: Path, text: str) -> None:
    assert any("a key must be a word" in line for line in refusal(tmp_path, text))


@pytest.mark.usefixtures("either_parser")
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    content=st.binary(max_size=300)
    | st.text(max_size=300).map(lambda text: text.encode(errors="replace"))
    | st.lists(st.sampled_from(PIECES), max_size=40).map(lambda pieces: "".join(pieces).encode())
)
def test_no_bytes_make_it_stumble(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    path = write(tmp_path_factory.mktemp("any"), content)
    with pytest.raises(UsageError, match=r"house\.yaml:\d+:\d+: "):
        load_model(path, House)


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("modulaton_hz", "; did you mean 'modulation_hz'?"),
        ("CLOTHING", "; did you mean 'clothing'?"),
        ("x", ""),
    ],
)
def test_a_mistyped_word_is_recognised(word: str, expected: str) -> None:
    assert did_you_mean(word, ["modulation_hz", "clothing", "drive"]) == expected
