"""The SDK commands that the devices are sent, built by pure functions.

The tests feed these same commands to the SDK's offline recorder, which shows what is emitted.
Bank B0 of the modulation always holds silence, bank B1 the burst.
"""

import numpy as np
from autd3 import Duration
from autd3.commands import (
    ActivateModulationBank,
    Clear,
    Command,
    FixedCompletionTime,
    Modulation,
    Pattern,
    SetSilencer,
)
from autd3.value import LoopBehavior, ModulationBank, SamplingConfig, SysTime, TransitionMode
from autd3_modulation import ModulationBuffer
from autd3_pattern import PhaseBuffer

from autd_trials.array.backend import Burst

SILENCE_BANK = ModulationBank.B0
BURST_BANK = ModulationBank.B1


def commands_to_open() -> list[Command]:
    """Return what makes devices of any history silent, with the silencer set.

    The silencer takes 250 us, one modulation sample, for each step of the amplitude, and 1 ms for the phase.
    That is the SDK's default, but the envelope is sampled for it (see `autd_trials.array.envelope`), so it is
    set explicitly. The zero modulation comes before any pattern: after `Clear` the modulation is at its full.
    """
    silencer = FixedCompletionTime(
        intensity=Duration.from_micros(250), phase=Duration.from_micros(1000), strict_mode=True
    )
    silence = Modulation(
        SamplingConfig.FREQ_4K,
        ModulationBuffer.from_array(np.zeros(2, np.uint8)),
        bank=SILENCE_BANK,
        loop_behavior=LoopBehavior.Infinite,
        transition_mode=TransitionMode.Immediate,
    )
    return [Clear(), SetSilencer(silencer), silence]


def commands_to_load(burst: Burst) -> list[Command]:
    """Return what preloads a burst: silence first, as the bank that plays must not be written."""
    modulation = Modulation(
        SamplingConfig.FREQ_4K,
        ModulationBuffer.from_array(burst.samples),
        bank=BURST_BANK,
        loop_behavior=LoopBehavior.Once,
        transition_mode=TransitionMode.Later,
    )
    return [command_to_silence(), modulation, Pattern(PhaseBuffer.from_array(burst.phases), burst.intensity)]


def command_to_start(device_ns: int) -> Command:
    """Return what starts the preloaded burst on all devices at a device time on the 250 us grid."""
    return ActivateModulationBank(BURST_BANK, TransitionMode.SysTime(SysTime.from_nanos(device_ns)))


def command_to_silence() -> Command:
    """Return what cancels a pending start and ends a playing burst at once."""
    return ActivateModulationBank(SILENCE_BANK, TransitionMode.Immediate)
