"""Keys from characters, and editing a line with them."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.terminal.keys import CONTROL_KEYS, KeyDecoder, LineEditor, plain_key

TYPED = st.lists(
    st.one_of(
        st.text(max_size=3),
        st.sampled_from(["\x1b", "\x1b[A", "\x1b[15~", "\x1bOP", "\x1bp", "\x1b[", "\x1bO", "\r"]),
    )
).map("".join)


@given(text=TYPED, cuts=st.lists(st.integers(0, 1000)))
def test_same_keys_however_chunked(text: str, cuts: list[int]) -> None:
    bounds = [0, *sorted(cut % (len(text) + 1) for cut in cuts), len(text)]
    chunked, whole = KeyDecoder(), KeyDecoder()
    keys = [key for start, end in itertools.pairwise(bounds) for key in chunked.feed(text[start:end])]
    assert keys + chunked.flush() == whole.feed(text) + whole.flush()


@given(TYPED)
def test_no_character_is_lost(text: str) -> None:
    decoder = KeyDecoder()
    assert "".join(decoder.feed(text) + decoder.flush()) == text.replace("\r", "\n")


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ("pna ", ["p", "n", "a", " "]),
        ("\r", ["\n"]),
        ("\x1b[Aa", ["\x1b[A", "a"]),  # arrow up
        ("\x1b[1;5Aa", ["\x1b[1;5A", "a"]),
        ("\x1b[5~ ", ["\x1b[5~", " "]),
        ("\x1bOa ", ["\x1bOa", " "]),  # rxvt's Ctrl-up: not the command a
        ("\x1ba", ["\x1ba"]),  # Alt-a: neither
        ("\x1b\x1b[A", ["\x1b", "\x1b[A"]),
        ("\x1bO\x1b[A", ["\x1bO", "\x1b[A"]),
        ("\x1b[\n ", ["\x1b[", "\n", " "]),
        ("ö日", ["ö", "日"]),
    ],
)
def test_keys(text: str, keys: list[str]) -> None:
    assert KeyDecoder().feed(text) == keys


def test_lone_escape_is_pending_until_flushed() -> None:
    decoder = KeyDecoder()
    assert decoder.feed("\x1b") == []
    pending = [decoder.pending]
    assert decoder.flush() == ["\x1b"]
    assert [*pending, decoder.pending] == [True, False]
    assert decoder.flush() == []


@pytest.mark.parametrize(
    ("keys", "text", "state"),
    [
        ("abc", "abc", "editing"),
        ("abc\n", "abc", "done"),
        ("ab\x7fc\n", "ac", "done"),
        ("\x7f\bx\n", "x", "done"),
        ("junk\x15ok\n", "ok", "done"),
        ("half\x1b", "half", "cancelled"),
        ("done\nmore\x1b", "done", "done"),
        ("a\tb\x01\n", "ab", "done"),
    ],
)
def test_line_editor(keys: str, text: str, state: str) -> None:
    editor = LineEditor()
    for key in keys:
        editor.feed(key)
    assert (editor.text, editor.state) == (text, state)


def test_line_has_an_end() -> None:
    editor = LineEditor()
    for _ in range(5000):
        editor.feed("x")
    assert len(editor.text) == 2000


@pytest.mark.parametrize(
    ("typed", "key"),
    [
        *[(key, key) for key in (" ", "\n", "\t", "7", "ß", "é", "\x1b[A", "\x1b")],
        ("\x00", " "),  # Ctrl with the space bar
        *[("P", "p"), ("Ａ", "a"), ("\u3000", " "), ("\u00a0", " ")],  # Caps Lock, wide forms, other spaces
        *[("з", "p"), ("т", "n"), ("ф", "a"), ("Ф", "a")],  # Russian
        *[("π", "p"), ("ν", "n"), ("α", "a"), ("פ", "p"), ("מ", "n"), ("ש", "a")],  # Greek, Hebrew
        *[("ㅔ", "p"), ("ㅜ", "n"), ("ㅁ", "a"), ("せ", "p"), ("み", "n"), ("ち", "a")],  # Korean, kana
        *[("\x1b[32u", " "), ("\x1b[97;1u", "a"), ("\x1b[1092::97u", "a"), ("\x1b[13u", "\n")],  # kitty
        *[("\x1b[97;5u", "\x01"), ("\x1b[9999999u", "\x1b[9999999u")],  # Ctrl-a is not a; no character
    ],
)
def test_the_key_that_is_meant_on_any_layout(typed: str, key: str) -> None:
    assert plain_key(typed) == key


@given(st.text(max_size=4))
def test_a_plain_key_is_its_own(text: str) -> None:
    plain = plain_key(text)
    assert plain_key(plain) == plain
    assert (plain in CONTROL_KEYS) <= (len(text) == 1)
