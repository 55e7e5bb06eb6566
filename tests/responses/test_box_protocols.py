"""Parsing what button boxes send."""

import itertools
import string

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from autd_trials.responses.box_protocols import (
    LONGEST_LINE_BYTES,
    BoxProtocol,
    Garbage,
    LineProtocol,
    Parser,
    Report,
    SingleByteProtocol,
    XidProtocol,
)

PROTOCOLS = [LineProtocol(), SingleByteProtocol(buttons={"A": "left", "0xff": "right"}), XidProtocol()]
# Bytes that mean something to one of the protocols come up often.
STREAMS = st.lists(
    st.one_of(
        st.binary(max_size=20),
        st.sampled_from(
            [b"B1 12\r\n", b"B2\n", b"\r", b"AA", b"\xff", b"k\x30\x01\x02\x03\x04", b"k", b"B" * 300]
        ),
    )
).map(b"".join)


Items = list[Report | Garbage]


def feed_in_chunks(parser: Parser, data: bytes, cuts: list[int]) -> Items:
    bounds = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    return [item for start, end in itertools.pairwise(bounds) for item in parser.feed(data[start:end])]


def reports(items: Items) -> list[Report]:
    return [item for item in items if isinstance(item, Report)]


def garbage_bytes(items: Items) -> int:
    return sum(item.size for item in items if isinstance(item, Garbage))


@pytest.mark.parametrize("protocol", PROTOCOLS, ids=lambda protocol: protocol.kind)
@given(data=STREAMS, cuts=st.lists(st.integers(0, 10_000)))
def test_same_reports_and_garbage_however_chunked(
    protocol: BoxProtocol, data: bytes, cuts: list[int]
) -> None:
    whole, chunked = protocol.parser(), protocol.parser()
    items = whole.feed(data)
    assert feed_in_chunks(chunked, data, cuts) == items
    assert chunked.pending == whole.pending
    given_up = whole.flush()
    assert chunked.flush() == given_up
    assert garbage_bytes([*items, *given_up]) <= len(data)
    assert not whole.pending


@given(
    presses=st.lists(st.tuples(st.integers(1, 9), st.integers(0, 2**32 - 1))),
    ending=st.sampled_from([b"\n", b"\r", b"\r\n"]),
    cuts=st.lists(st.integers(0, 10_000)),
)
def test_line_round_trip(presses: list[tuple[int, int]], ending: bytes, cuts: list[int]) -> None:
    data = b"".join(b"B%d %d" % press + ending for press in presses)
    parser = LineProtocol().parser()
    assert feed_in_chunks(parser, data, cuts) == [Report(f"B{n}", ms / 1000) for n, ms in presses]


@given(junk=st.binary(max_size=LONGEST_LINE_BYTES).filter(lambda junk: b"B" not in junk))
def test_line_parser_recovers_after_any_junk(junk: bytes) -> None:
    parser = LineProtocol().parser()
    items = parser.feed(junk + b"\nB1 5\n")
    assert reports(items) == [Report("B1", 0.005)]
    assert garbage_bytes(items) == sum(len(line) for line in junk.splitlines() if line.strip(b" \t"))


def test_half_a_line_is_no_press_until_it_ends() -> None:
    parser = LineProtocol().parser()
    assert parser.feed(b"B1 12") == []
    assert parser.feed(b"3") == []
    assert parser.feed(b"\n") == [Report("B1", 0.123)]


def test_endless_line_is_counted_and_not_kept() -> None:
    parser = LineProtocol().parser()
    for _ in range(1000):
        assert parser.feed(b"B" * 1000) == []
    garbage, press = parser.feed(b"1 5\nB2\n")
    assert garbage == Garbage(1_000_003, b"B" * 40)
    assert press == Report("B2")


def test_a_message_whose_end_does_not_come_is_given_up() -> None:
    parser = LineProtocol().parser()
    assert parser.feed(b"B1 12345 ") == []
    assert parser.pending
    assert parser.flush() == [Garbage(9, b"B1 12345 ")]
    assert parser.feed(b"B1\n") == [Report("B1")]


def test_declared_signs_of_life_are_no_garbage() -> None:
    parser = LineProtocol(ignore="alive|release .*").parser()
    assert parser.feed(b"alive\nB1\nrelease B1\nalive?\n") == [Report("B1"), Garbage(6, b"alive?")]
    parser = SingleByteProtocol(buttons={"A": "left"}, ignore=("a", "0x00")).parser()
    assert parser.feed(b"Aa\x00b") == [Report("left"), Garbage(1, b"b")]


@pytest.mark.timeout(10)
@pytest.mark.parametrize(
    "press", [r"(?P<button>(a+)+)b", r"(?P<button>a)(a|a)*(a|a)*(a|a)*b", r"(?P<button>(a*)*)*c"]
)
def test_no_expression_holds_up_the_session(press: str) -> None:
    parser = LineProtocol(press=press).parser()
    data = (b"a" * LONGEST_LINE_BYTES + b"\n") * 200
    assert garbage_bytes(parser.feed(data)) == 200 * LONGEST_LINE_BYTES


@pytest.mark.parametrize("stamp", ["nan", "inf", "-inf", "9" * 200, "1e308", "1_0"])
def test_a_stamp_that_is_no_time_is_no_press(stamp: str) -> None:
    parser = LineProtocol(press="(?P<button>B1) (?P<ms>.*)").parser()
    data = f"B1 {stamp}".encode()
    expected: Items = [Garbage(len(data), data[:40])]
    assert parser.feed(data + b"\n") == ([Report("B1", 0.01)] if stamp == "1_0" else expected)


@pytest.mark.parametrize(
    ("protocol", "felt"),
    [
        (LineProtocol(), {"B1"}),
        (LineProtocol(felt=("B2", "B3")), {"B2", "B3"}),
        (SingleByteProtocol(buttons={"A": "left"}), {"left"}),
        (SingleByteProtocol(buttons={"A": "left", "B": "right"}, felt=("right",)), {"right"}),
        (XidProtocol(), {"1"}),
    ],
)
def test_which_buttons_mean_felt(protocol: BoxProtocol, felt: set[str]) -> None:
    assert protocol.buttons_felt == felt


@pytest.mark.parametrize(
    ("press", "line", "report"),
    [
        (r"(?P<button>left|right)", b"left", Report("left")),
        (r"(?P<button>\w+),(?P<us>\d+)", b"go,2500", Report("go", 0.0025)),
        (r"t=(?P<ms>[\d.]+) (?P<button>\d)", b"t=1.5 7", Report("7", 0.0015)),
        (r"(?P<button>B\d)( (?P<ms>\d+))?", b"  B3\t", Report("B3")),
    ],
)
def test_own_expressions(press: str, line: bytes, report: Report) -> None:
    assert LineProtocol(press=press).parser().feed(line + b"\n") == [report]


@pytest.mark.parametrize(
    ("press", "line"),
    [
        (r"(?P<button>B\d)(?P<ms>.*)", b"B1 soon"),  # the stamp is no number
        (r"(?P<button>B?) (?P<ms>\d+)", b" 12"),  # the button is empty
        (r"(?P<button>B\d)", b"B1 12"),  # more than a press
        (r"(?P<button>B\d)", b"b1"),
        (r"(?P<button>\d)", "٣".encode()),  # a digit, but of another script
    ],
)
def test_what_does_not_fit_is_garbage(press: str, line: bytes) -> None:
    parser = LineProtocol(press=press).parser()
    assert parser.feed(line + b"\n") == [Garbage(len(line), line)]


@given(st.binary())
def test_single_bytes(data: bytes) -> None:
    parser = SingleByteProtocol(buttons={"A": "left", "1": "one", "0xff": "right"}).parser()
    names = {0x41: "left", 0x31: "one", 0xFF: "right"}
    assert parser.feed(data) == [
        Report(names[byte]) if byte in names else Garbage(1, bytes([byte])) for byte in data
    ]


def test_xid_packets_as_the_makers_library_reads_them() -> None:
    # 0x30: button 1 pressed, port 0; 0x20: released; 0x10: button 8 pressed (coded 0); 0xf1: button 7, port 1
    data = bytes.fromhex("6b30e8030000 6b20f0030000 6b1001000000 6bf1ffffffff")
    assert XidProtocol().parser().feed(data) == [
        Report("1", 1.0),
        Report("8", 0.001),
        Report("7", 4294967.295),
    ]


def test_xid_finds_its_feet_again() -> None:
    parser = XidProtocol().parser()
    items = parser.feed(b"_xid0kk" + b"k\x30\x01\x00\x00\x00")
    assert reports(items) == [Report("1", 0.001)]
    assert garbage_bytes(items) == 7


@pytest.mark.parametrize(
    "data",
    [
        {"kind": "line", "press": "("},
        {"kind": "line", "press": "B1"},
        {"kind": "line", "press": "(?P<button>L|R)"},  # which of them means felt?
        {"kind": "line", "press": r"(?P<button>(B)\2)", "felt": ["B"]},
        {"kind": "line", "press": "(?P<button>a{1000}){1000}", "felt": ["B"]},
        {"kind": "line", "ignore": "("},
        {"kind": "line", "felt": []},
        {"kind": "single_byte", "buttons": {"A": "left", "B": "right"}},
        {"kind": "single_byte", "buttons": {"A": "left"}, "felt": ["lef"]},
        {"kind": "line", "baud": 0},
        {"kind": "single_byte"},
        {"kind": "single_byte", "buttons": {}},
        {"kind": "single_byte", "buttons": {"AB": "left"}},
        {"kind": "single_byte", "buttons": {"0x1ff": "left"}},
        {"kind": "single_byte", "buttons": {"A": ""}},
        {"kind": "morse"},
    ],
)
def test_bad_protocols_are_refused(data: dict[str, object]) -> None:
    adapter: TypeAdapter[BoxProtocol] = TypeAdapter(BoxProtocol)
    with pytest.raises(ValidationError):
        adapter.validate_python(data)


@given(st.sampled_from(string.printable[:94]))
def test_any_printable_character_may_be_a_button(character: str) -> None:
    parser = SingleByteProtocol(buttons={character: "it"}).parser()
    assert parser.feed(character.encode()) == [Report("it")]
