"""Random protocols, written by somebody harsh: names, levels, methods, limits and units at their edges."""

from typing import Any

from hypothesis import strategies as st

TINY, STEP = 5e-324, 1 / 255


def mostly(usual: st.SearchStrategy[Any], harsh: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    """Return the usual in five of six draws: were all of a protocol harsh, all would be refused."""
    return st.sampled_from([usual] * 5 + [harsh]).flatmap(lambda drawn: drawn)


NAMES = st.sampled_from(
    [
        *(
            "clothing",
            "posture",
            "rate",
            "felt",
            "trials",
            "notes",
            "used",
            "participants",
            "interval",
            "mean",
        ),
        *(
            "first",
            "index",
            "class",
            "lambda",
            "c",
            "q",
            "e",
            "x",
            "np",
            "size",
            "count",
            "level",
            "condition",
        ),
        *(
            "conditions",
            "name",
            "id",
            "key",
            "p",
            "n",
            "file",
            "time",
            "sum",
            "self",
            "columns",
            "t",
            "sex",
            "age",
        ),
        *("event", "format", "protocol", "plan", "values", "intercept", "answer", "group", "weight", "catch"),
    ]
) | st.from_regex(r"[a-z][a-z0-9_]{0,39}", fullmatch=True)
WORDS = mostly(
    st.sampled_from(
        ["a", "b", "inner", "inner_outer", "x+y", "x-y", "x.y", "stimulus", "catch", "all", "felt", "e1"]
    ),
    st.sampled_from(["A", "n.a", "nan", "NA", "yes", "on", "Infinity", "a" * 40])
    | st.from_regex(r"[A-Za-z][A-Za-z0-9_.+-]{0,39}", fullmatch=True),
)
NUMBERS = st.sampled_from(
    [0, -0.0, 1, 2, 0.1, 1e-6, 5e-05, 1e9, 123456.7, -3, 1e16, 1 / 3, TINY]
) | st.floats(-1e9, 1e9)


QUANTITIES: dict[str, st.SearchStrategy[Any]] = {
    "duration_s": mostly(
        st.sampled_from([0.1, 0.2, 1 / 3, 1]),
        st.sampled_from([0.0003, 0.0005, 0.001, 2, 16]) | st.floats(0.01, 2),
    ),
    "modulation_hz": mostly(
        st.sampled_from([25, 50, 333.3, 1000]), st.sampled_from([TINY, 0.5, 1, 5]) | st.floats(1, 1000)
    ),
    "waveform": st.sampled_from(["sine", "square", "constant"]),
    "depth": mostly(st.sampled_from([0.25, 0.5, 1]), st.sampled_from([0, STEP]) | st.floats(0, 1)),
    "drive": mostly(
        st.sampled_from([STEP, 0.25, 0.5, 1]), st.sampled_from([0, STEP / 2, 2 * STEP]) | st.floats(0, 1)
    ),
    "force_law": st.sampled_from(["amplitude", "pressure"]),
    "ramp_s": mostly(st.sampled_from([0, 0.005]), st.sampled_from([TINY, 1e-9, 0.00025]) | st.floats(0, 0.1)),
    "target": st.sampled_from(["chest", "palm"]),
}
TIMES = mostly(st.sampled_from([1, 2]), st.sampled_from([TINY, 1e-7, 0.0004, 0.1, 1 / 3, 1.0000004]))


@st.composite
def protocols(draw: st.DrawFn) -> dict[str, Any]:
    """Return the data of a small protocol that a loader may accept or not; about half should be."""
    within = draw(st.lists(st.sampled_from(sorted(QUANTITIES)), max_size=2, unique=True))
    between = draw(st.lists(NAMES | st.sampled_from(sorted(QUANTITIES)), max_size=2, unique=True))
    between = [name for name in between if name not in within]
    data: dict[str, Any] = {
        "name": draw(mostly(st.just("p"), st.sampled_from(["a-b", "0", "007", "x" * 60, "nan", "con", "P"]))),
        "description": "Whether it is felt.",
        "study": {
            "title": draw(st.sampled_from(["A study", "=1+1", "<b>", "研究", "a\tb", "# x"])),
            "authors": ["A. One", "B. Two"],
            "institution_name": "An Institute",
            "institution_address": "1 Street",
            "department": "Haptics",
            "ethics_approval": "none needed",
        },
        "instructions": "Press when you feel it.",
        "targets": {
            "chest": {"x_mm": 302, "y_mm": 225, "z_mm": 1000},
            "palm": {"x_mm": 302 + draw(st.integers(-30, 30)), "y_mm": 225, "z_mm": 990},
        },
        "stimulus": {
            "duration_s": draw(QUANTITIES["duration_s"]),
            "modulation_hz": draw(QUANTITIES["modulation_hz"]),
            "target": "chest",
            **draw(st.fixed_dictionaries({}, optional={key: QUANTITIES[key] for key in OPTIONAL})),
        },
        "factors": {
            "within_block": {name: draw(factors(name)) for name in within},
            "between_blocks": {name: draw(factors(name)) for name in between},
        },
        "repetitions": draw(st.integers(1, 4)),
        "catch_trials_per_block": draw(st.integers(0, 3)),
        "order": draw(orders(within)),
        "timing": draw(timings()),
        "response": {"question": "Felt?"},
        "safety": draw(limits()),
    }
    free = [name for name in METHODS if name not in {*within, *between}]
    if free and draw(st.sampled_from([True, False])):
        data["method"] = draw(methods(draw(st.sampled_from(free))))
    if names := [*within, *between]:
        declared = {**data["factors"]["within_block"], **data["factors"]["between_blocks"]}
        names = [name for name in names if len(declared[name]["levels"]) > 1]
        data["comparisons"] = draw(st.lists(comparisons(names, declared), max_size=2)) if names else []
    return data


OPTIONAL = ("waveform", "depth", "drive", "force_law", "ramp_s")
METHODS = ("drive", "depth", "duration_s", "modulation_hz")


@st.composite
def factors(draw: st.DrawFn, name: str) -> dict[str, Any]:
    """Return a factor's levels: of the stimulus' quantity, or what a person arranges."""
    one = QUANTITIES[name] if name in QUANTITIES else draw(st.sampled_from([WORDS, NUMBERS]))
    levels = draw(st.lists(one, min_size=1, max_size=4, unique_by=lambda level: (type(level), level)))
    describe = {str(level): "What it is." for level in levels if draw(st.booleans())}
    return {"levels": levels, "describe": describe}


@st.composite
def methods(draw: st.DrawFn, varies: str) -> dict[str, Any]:
    """Return a staircase or QUEST+ over a quantity."""
    ends = sorted(draw(st.lists(QUANTITIES[varies], min_size=2, max_size=2, unique=True)))
    levels = {"smallest": ends[0], "largest": ends[1], "levels": draw(st.integers(3, 12))}
    if draw(st.booleans()):
        return {
            "kind": "quest_plus",
            "varies": varies,
            "range": levels,
            "slopes": [draw(st.floats(0.1, 50)), 3],
        }
    steps = st.integers(1, 50)
    return {
        "kind": "staircase",
        "varies": varies,
        "range": levels,
        "start": draw(st.sampled_from(ends)),
        "felt_to_go_down": draw(st.integers(1, 10)),
        "step_up": draw(steps),
        "step_down": draw(steps),
        "step_factors": draw(st.lists(steps, min_size=1, max_size=3)),
    }


@st.composite
def orders(draw: st.DrawFn, within: list[str]) -> dict[str, Any]:
    order: dict[str, Any] = {
        "trials": draw(st.sampled_from(["shuffled", "shuffled", "fixed"])),
        "blocks": draw(st.sampled_from(["balanced_latin_square", "shuffled", "fixed"])),
    }
    if order["trials"] == "shuffled" and draw(st.booleans()):
        order["max_run_length"] = draw(st.integers(1, 5))
        order["max_run_of"] = draw(st.sampled_from([None, "trial_type", *within]))
    return order


@st.composite
def timings(draw: st.DrawFn) -> dict[str, Any]:
    pauses_s = sorted([draw(TIMES), draw(TIMES)])
    return {
        "lead_in_s": draw(st.sampled_from([0, TINY, 5])),
        "response_window_s": draw(mostly(st.just(2), TIMES)),
        "pause_min_s": pauses_s[0],
        "pause_max_s": pauses_s[1],
        "break_s": draw(st.sampled_from([0, 1e-9, 3600])),
    }


@st.composite
def limits(draw: st.DrawFn) -> dict[str, Any]:
    return {
        "largest_drive": draw(mostly(st.just(1), st.sampled_from([STEP, 0.5]))),
        "longest_burst_s": draw(mostly(st.just(16), st.just(1))),
        "largest_duty": draw(mostly(st.just(1), st.floats(0.1, 1))),
        "session_exposure_s": draw(mostly(st.just(120), st.floats(0.1, 120))),
        **draw(st.fixed_dictionaries({}, optional={"daily_exposure_s": st.floats(50, 500)})),
    }


@st.composite
def comparisons(draw: st.DrawFn, names: list[str], declared: dict[str, Any]) -> dict[str, Any]:
    factor = draw(st.sampled_from(names))
    levels = declared[factor]["levels"]
    return {
        "factor": factor,
        "first": levels[0],
        "second": levels[-1],
        "at_each": draw(st.sampled_from([None, *(name for name in names if name != factor)])),
    }
