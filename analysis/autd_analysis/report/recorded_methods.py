"""How a study was run, from its logs, as sentences for a manuscript's methods."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence

from autd_analysis.data.trials import Trials
from autd_analysis.report.wording import MINUS, THIN
from autd_trials.protocol.schema import Protocol
from autd_trials.session.events import SessionStart
from autd_trials.tables import level_text

_EN_DASH = "\N{EN DASH}"
_OPEN_QUOTE, _CLOSE_QUOTE = "\N{LEFT DOUBLE QUOTATION MARK}", "\N{RIGHT DOUBLE QUOTATION MARK}"
_FORCE = {"amplitude": "the pressure amplitude", "pressure": "the radiation pressure"}
_BLOCKS = {
    "balanced_latin_square": "in an order balanced over participants by a Latin square",
    "shuffled": "in an order shuffled for each participant",
    "fixed": "in the same order for all",
}
_TRIALS = {"shuffled": "in shuffled order", "fixed": "in a fixed order"}
_DIGITS = 4


def recorded_methods(trials: Trials) -> tuple[tuple[str, str], ...]:
    """Return headings and paragraphs: stimulus, timing, masking, place; nothing where there are no logs.

    Parameters
    ----------
    trials
        The study's trials.
    """
    starts = [session.start for session in trials.logged]
    if not starts:
        return ()
    parts: tuple[tuple[str, Callable[[SessionStart], Iterator[str]]], ...] = (
        ("Stimulus", _stimulus),
        ("Timing and task", _timing),
        ("Masking", _masking),
        ("Place", _place),
    )
    return tuple((heading, _said(starts, sentences)) for heading, sentences in parts)


def _said(starts: Sequence[SessionStart], sentences: Callable[[SessionStart], Iterator[str]]) -> str:
    """Return the sentences of all sessions, each once; of how many sessions, where not of all."""
    counts = Counter(sentence for start in starts for sentence in dict.fromkeys(sentences(start)))
    return " ".join(
        sentence
        if count == len(starts)
        else f"{sentence.removesuffix('.')} (in {count} of {len(starts)} sessions)."
        for sentence, count in counts.items()
    )


def _stimulus(start: SessionStart) -> Iterator[str]:
    protocol, spec = start.protocol, start.protocol.stimulus
    array = start.devices.array if start.devices else None
    if array is not None:
        emulated = "emulated " if array.emulated else ""
        yield (
            f"Ultrasound of 40{THIN}kHz came from {array.devices} {emulated}AUTD3 device"
            f"{'s' * (array.devices != 1)} ({array.transducers} transducers)."
        )
    ramps = f" with raised-cosine ramps of {_number(1000 * spec.ramp_s)}{THIN}ms" if spec.ramp_s else ""
    yield f"A stimulus was a focus for {_values(protocol, 'duration_s', 's')}{ramps}."
    if spec.waveform == "constant":
        yield "It was not modulated."
    else:
        yield (
            f"{_FORCE[spec.force_law].capitalize()} was modulated by a {spec.waveform} of "
            f"{_values(protocol, 'modulation_hz', 'Hz')}, depth {_values(protocol, 'depth')}."
        )
    yield f"The drive was {_values(protocol, 'drive')} of the largest pressure amplitude."


def _timing(start: SessionStart) -> Iterator[str]:
    protocol, timing = start.protocol, start.protocol.timing
    question = protocol.response.question.strip()
    yield f"Participants were asked: {_OPEN_QUOTE}{question}{_CLOSE_QUOTE}"
    if start.devices:
        kind = start.devices.responder.kind
        yield "Answers were simulated." if start.simulated else f"They answered by {kind.replace('_', ' ')}."
    yield (
        f"A press within {_number(timing.response_window_s)}{THIN}s of the onset counted as felt, none as "
        f"not felt; a pause of {_number(timing.pause_min_s)}{_EN_DASH}{_number(timing.pause_max_s)}{THIN}s, "
        "drawn evenly, followed."
    )
    blocks = max(1, len(start.plan.blocks))
    catch = protocol.catch_trials_per_block
    each = "in each adaptive run" if protocol.method else "of each kind"
    yield (
        f"A session had {blocks} block{'s' * (blocks != 1)} of {protocol.repetitions} stimuli {each} and "
        f"{catch or 'no'} catch trial{'s' * (catch != 1)}, {_TRIALS[protocol.order.trials]}, after a "
        f"lead-in of {_number(timing.lead_in_s)}{THIN}s."
    )
    if protocol.order.max_run_length:
        yield f"No more than {protocol.order.max_run_length} of a kind came in a row."
    if blocks > 1:
        yield (
            f"Blocks came {_BLOCKS[protocol.order.blocks]}, with a break of at least "
            f"{_number(timing.break_s)}{THIN}s between them."
            if timing.break_s
            else f"Blocks came {_BLOCKS[protocol.order.blocks]}."
        )


def _masking(start: SessionStart) -> Iterator[str]:
    masker = start.devices.masker if start.devices else None
    if start.protocol.masking is None:
        yield "No sound masked that of the array."
        return
    level = start.protocol.masking
    said = (
        f"{_number(level.level_dba)}{THIN}dB(A) at the ear"
        if level.level_dba is not None
        else f"{_number(level.level_dbfs or 0.0)}{THIN}dB re digital full scale (RMS)"
    )
    yield f"Pink noise of {said} masked the sound of the array."
    if masker is not None and masker.kind == "emulated":
        yield "The player was emulated: no sound was heard."


def _place(start: SessionStart) -> Iterator[str]:
    protocol = start.protocol
    used = _levels(protocol, "target") or [protocol.stimulus.target]
    places = "; ".join(f"{name} at {_point(protocol, str(name))}" for name in used)
    yield (f"Foci, in mm in the frame of unit 1 (x to the right along it, y up, z away from it): {places}.")
    if protocol.head is not None:
        head = protocol.head
        yield f"The middle between the ears: {_coordinates(head.x_mm, head.y_mm, head.z_mm)}."
    units = start.calibration.get("units")
    if isinstance(units, list) and units:
        made_up = " It is made up, not measured." if start.calibration.get("made_up") else ""
        method = start.calibration.get("method")
        how = f" ({method})" if isinstance(method, str) and not made_up else ""
        count = f"{len(units)} unit{'s' * (len(units) != 1)}"
        yield f"The poses of {count} came from a calibration{how}.{made_up}"


def _values(protocol: Protocol, field: str, unit: str = "") -> str:
    """Return a field of the stimulus in words: its levels where it was varied, and who chose them."""
    unit = f"{THIN}{unit}" if unit else ""
    if protocol.method is not None and protocol.method.varies == field:
        ends = _EN_DASH.join(map(_number, protocol.method.range.ends))
        return f"{ends}{unit} (chosen by the adaptive method)"
    levels = [level_text(level) for level in _levels(protocol, field)] or [
        _number(getattr(protocol.stimulus, field))
    ]
    return f"{' or '.join(filter(None, (', '.join(levels[:-1]), levels[-1])))}{unit}"


def _levels(protocol: Protocol, field: str) -> list[float | str]:
    factors = {**protocol.factors.within_block, **protocol.factors.between_blocks}
    return list(factors[field].levels) if field in factors else []


def _point(protocol: Protocol, name: str) -> str:
    target = protocol.targets[name]
    return _coordinates(target.x_mm, target.y_mm, target.z_mm)


def _coordinates(*values: float) -> str:
    return f"({', '.join(map(_number, values))})"


def _number(value: float) -> str:
    return level_text(float(f"{value:.{_DIGITS}g}")).replace("-", MINUS)
