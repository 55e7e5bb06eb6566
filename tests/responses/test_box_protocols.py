"""Parsing what button boxes send."""

import itertools
import string
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from autd_trials.responses.box_protocols import (
    LONGEST_LINE_BYTES,
    BoxProtocol,
    Garbage,
    LineProtocol,
    Message,
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


def feed_in_chunks(parser: Parser, data: bytes, cuts: list[int]) -> list[Message]:
    bounds = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    return [message for start, end in itertools.pairwise(bounds) for message in parser.feed(data[start:end])]


def reports(messages: list[Message]) -> list[Report]:
    return [message for message in messages if isinstance(message, Report)]


def garbage(messages: list[Message]) -> bytes:
    return b"".join(message.data for message in messages if isinstance(message, Garbage))


@pytest.mark.parametrize("protocol", PROTOCOLS, ids=lambda protocol: protocol.kind)
@given(data=STREAMS, cuts=st.lists(st.integers(0, 10_000)))
def test_same_reports_and_garbage_however_chunked(
    protocol: BoxProtocol, data: bytes, cuts: list[int]
) -> None:
    whole, chunked = protocol.parser(), protocol.parser()
    one, two = feed_in_chunks(chunked, data, cuts) + chunked.flush(), whole.feed(data) + whole.flush()
    assert reports(one) == reports(two)
    assert garbage(one) == garbage(two)
    assert len(garbage(one)) <= len(data)


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
    assert reports(parser.feed(junk + b"\nB1 5\n")) == [Report("B1", 0.005)]


def test_half_a_line_is_no_press_until_it_ends() -> None:
    parser = LineProtocol().parser()
    assert parser.feed(b"B1 12") == []
    assert parser.feed(b"3") == []
    assert parser.feed(b"\n") == [Report("B1", 0.123)]


def test_an_endless_line_is_told_once_and_not_kept() -> None:
    parser = LineProtocol().parser()
    told = [message for _ in range(1000) for message in parser.feed(b"B" * 1000)]
    assert told == [Garbage(b"B" * LONGEST_LINE_BYTES, "a line of more than 256 bytes")]
    assert parser.feed(b"1 5\nB2\n") == [Report("B2")]


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
        (r"(?P<button>B\d) (?P<ms>.*)", b"B1 nan"),
        (r"(?P<button>B\d) (?P<ms>.*)", b"B1 1e999"),
        (r"(?P<button>B\d) (?P<us>.*)", b"B1 -inf"),
        (r"(?P<button>B\d) (?P<ms>\d+)", b"B1 " + b"9" * 200),
        (r"(?P<button>B?) (?P<ms>\d+)", b" 12"),  # the button is empty
        (r"(?P<button>B\d)", b"B1 12"),  # more than a press
        (r"(?P<button>B\d)", b"b1"),
        (r"(?P<button>\d)", "٣".encode()),  # a digit, but of another script
    ],
)
def test_what_does_not_fit_is_garbage(press: str, line: bytes) -> None:
    parser = LineProtocol(press=press).parser()
    (message,) = parser.feed(line + b"\n")
    assert isinstance(message, Garbage)
    assert message.data == line


@given(st.binary())
def test_single_bytes(data: bytes) -> None:
    parser = SingleByteProtocol(buttons={"A": "left", "1": "one", "0xff": "right"}).parser()
    names = {0x41: "left", 0x31: "one", 0xFF: "right"}
    messages = parser.feed(data)
    assert reports(messages) == [Report(names[byte]) for byte in data if byte in names]
    assert garbage(messages) == bytes(byte for byte in data if byte not in names)


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
    assert parser.feed(b"_xid0kk" + b"k\x30\x01\x00\x00\x00") == [
        Garbage(b"_xid0kk", "no packet of an XID pad"),
        Report("1", 0.001),
    ]


@pytest.mark.parametrize(
    "data",
    [
        {"kind": "line", "press": "("},
        {"kind": "line", "press": "B1"},
        {"kind": "line", "baud": 0},
        {"kind": "single_byte"},
        {"kind": "single_byte", "buttons": {}},
        {"kind": "single_byte", "buttons": {"AB": "left"}},
        {"kind": "single_byte", "buttons": {"0x1ff": "left"}},
        {"kind": "single_byte", "buttons": {"A": ""}},
        {"kind": "line", "press": "(?P<button>B)\\1"},
        {"kind": "line", "ignore": ["(a*)*"]},
        {"kind": "single_byte", "buttons": {"A": "left"}, "ignore": ["AB"]},
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


@pytest.mark.parametrize(
    ("line", "why"),
    [
        (b"b1 12", "a press but for upper or lower case"),
        (b"B1,12", "no press of the box's protocol"),
        (b"\x86\x06\x9e", "no text of the box's protocol; perhaps another baud"),
    ],
)
def test_garbage_says_what_may_be_wrong(line: bytes, why: str) -> None:
    assert LineProtocol().parser().feed(line + b"\n") == [Garbage(line, why)]


def test_what_is_declared_to_mean_nothing_is_no_garbage() -> None:
    parser = LineProtocol(ignore=("alive", r"temp \d+")).parser()
    assert parser.feed(b"alive\r\nB1\r\ntemp 25\r\ndead\r\n") == [
        Report("B1"),
        Garbage(b"dead", "no press of the box's protocol"),
    ]
    single = SingleByteProtocol(buttons={"A": "left"}, ignore=("a",)).parser()
    assert single.feed(b"AaAb") == [Report("left"), Report("left"), Garbage(b"b", "no button's byte")]


def test_a_message_without_end_is_given_up() -> None:
    parser = LineProtocol().parser()
    assert parser.feed(b"B1 5") == []
    pending = [parser.pending]
    assert parser.flush() == [Garbage(b"B1 5", "no end of line came")]
    assert [*pending, parser.pending] == [True, False]
    assert parser.feed(b"B1 6\n") == [Report("B1", 0.006)]


@pytest.mark.parametrize("protocol", PROTOCOLS, ids=lambda protocol: protocol.kind)
def test_ten_thousand_random_streams_are_survived_in_bounded_memory(protocol: BoxProtocol) -> None:
    random, parser = Random(2026), protocol.parser()
    for _ in range(10_000):
        end = random.choice([b"", b"B1 1\n", b"k\x30AAAA", b"B" * 300])
        data = random.randbytes(random.randrange(1, 40)) + end
        messages = parser.feed(data) + parser.flush()
        assert sum(len(m.data) for m in messages if isinstance(m, Garbage)) <= len(data)
        assert not parser.pending
