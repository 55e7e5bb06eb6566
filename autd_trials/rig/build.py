"""Devices, built from a rig file. The only place that decides what is real."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from autd_trials.clock import Clock
from autd_trials.errors import UnsafeError, UsageError
from autd_trials.protocol.schema import Protocol
from autd_trials.rig.load import LoadedRig
from autd_trials.rig.schema import (
    EmulatedSoundSpec,
    NetworkLinkSpec,
    RealSoundSpec,
    Rig,
    SerialSpec,
)
from autd_trials.session.devices import Devices
from autd_trials.session.preflight import Used
from autd_trials.stimulus import Limits

if TYPE_CHECKING:
    from autd_trials.array.driver import ArrayDriver
    from autd_trials.array.ears import EarWatch
    from autd_trials.array.geometry import UnitPose
    from autd_trials.masking.level import Headphones
    from autd_trials.masking.masker import Masker
    from autd_trials.participants.simulated import SimulatedParticipant
    from autd_trials.responses.responder import Responder
    from autd_trials.terminal import Terminal

NO_AUDIO = "none"
_UNUSED = Used()


@dataclass(frozen=True)
class Builder:
    """Builds the devices of a session.

    Parameters
    ----------
    loaded_rig, protocol
        What the session runs on with its calibration, what is to be done.
    clock
        The session's clock.
    virtual
        The clock is virtual: the array is the in-process one, and nothing plays.
    audio
        What the command line says about sound: None (as the rig says), "none", or a device.
    """

    loaded_rig: LoadedRig
    protocol: Protocol
    clock: Clock
    virtual: bool
    audio: str | None = None

    @property
    def rig(self) -> Rig:
        """The rig, without its calibration."""
        return self.loaded_rig.rig

    @property
    def limits(self) -> Limits:
        """The limits under which both rig and protocol hold."""
        return self.rig.array.limits.and_also(self.protocol.safety)

    def live(self, terminal: "Terminal", *, used: Used, seed: int) -> Devices:
        """Return the devices of a session with a person."""
        return Devices(self.array(used), self.masker(seed, simulated=False), self._responder(terminal))

    def simulated(self, participant: "SimulatedParticipant", *, used: Used, seed: int) -> Devices:
        """Return the devices of a session with a simulated participant.

        Raises
        ------
        UsageError
            The rig's array is real: nobody is there to be stimulated.
        """
        if not self.rig.emulated:
            raise UsageError(
                f"rig {self.rig.name!r} has a real array; simulated participants only run on an emulated one",
                do="leave out --simulate, or use a rig whose array.link is emulator",
            )
        return Devices(self.array(used), self.masker(seed, simulated=True), participant)

    def array(self, used: Used = _UNUSED) -> "ArrayDriver":
        """Return the array with the limits of both rig and protocol, some of which may be used up."""
        from autd_trials.array.autd3_backend import Autd3Backend
        from autd_trials.array.link import EmulatorLink, NetworkLink
        from autd_trials.array.phased_array import PhasedArray
        from autd_trials.array.virtual_backend import VirtualBackend

        units = self.loaded_rig.calibration.unit_poses()
        link = self.rig.array.link
        real = NetworkLink(link.interface) if isinstance(link, NetworkLinkSpec) else EmulatorLink()
        return PhasedArray(
            units,
            VirtualBackend(self.clock) if self.virtual else Autd3Backend(real, self.clock),
            self.limits,
            self.clock,
            speed_of_sound_m_s=self.rig.air.speed_of_sound_m_s,
            exposure_used_s=used.session_s,
            daily_used_s=used.today_s,
            earlier_bursts=_on_the_clock(used, self.clock),
            ears=self._ears(units),
        )

    def predicted_force_mn(self) -> dict[str, float]:
        """Return the force at each target at full drive, in mN, where the units really stand."""
        import numpy as np

        from autd_trials.acoustics.focus_metrics import focus_force_mn
        from autd_trials.array.emission import focused_sources

        air, forces = self.rig.air, {}
        for name, target in self.protocol.targets.items():
            target_mm = (target.x_mm, target.y_mm, target.z_mm)
            sources = focused_sources(
                self.loaded_rig.true_calibration.unit_poses(),
                target_mm,
                speed_of_sound_m_s=air.speed_of_sound_m_s,
                believed=self.loaded_rig.calibration.unit_poses(),
            )
            forces[name] = focus_force_mn(sources, air, np.array(target_mm))
        return forces

    def _ears(self, units: "list[UnitPose]") -> "EarWatch | None":
        """Return what watches over the level at the ears; a real array is not used without it."""
        from autd_trials.array.ears import EarWatch, Head

        head = self.protocol.head
        if head is None and not self.rig.emulated:
            raise UnsafeError(
                f"protocol {self.protocol.name!r} does not say where the head is, so that the level at the "
                "ears cannot be predicted",
                do="give head: {x_mm: ..., y_mm: ..., z_mm: ...} in the protocol, as measured",
            )
        heads = [
            Head(other.who, (other.x_mm, other.y_mm, other.z_mm), other.hearing_protection_db)
            for other in self.rig.other_heads
        ]
        if head is not None:
            worn_db = self.rig.hearing_protection_db
            heads.insert(0, Head("participant", (head.x_mm, head.y_mm, head.z_mm), worn_db))
        if not heads:
            return None
        return EarWatch(units, heads, self.rig.air, largest_db=self.rig.array.limits.largest_ear_level_db)

    def masker(self, seed: int, *, simulated: bool) -> "Masker | None":
        """Return the masker; None where the protocol asks for none or --audio none declined it."""
        from autd_trials.masking.emulated import EmulatedMasker
        from autd_trials.masking.level import resolve_level
        from autd_trials.masking.player import SoundMasker

        masking = self.protocol.masking
        if masking is None or self.audio == NO_AUDIO:
            return None
        sound = self.rig.sound
        if self.audio is None and sound is None:
            raise UsageError(
                f"protocol {self.protocol.name!r} asks for masking; rig {self.rig.name!r} has no sound",
                do="add a sound section to the rig file, name a device with --audio DEVICE, "
                "or run without masking with --audio none (the log will say so)",
            )
        headphones = _headphones(sound)
        level = resolve_level(
            level_dbfs=masking.level_dbfs, level_dba=masking.level_dba, headphones=headphones
        )
        if self.audio is None and (simulated or not isinstance(sound, RealSoundSpec)):
            return EmulatedMasker(level.dbfs, self.clock, level_dba=level.dba)
        rate_hz = sound.sample_rate_hz if isinstance(sound, RealSoundSpec) else 48_000
        device = (
            self.audio if self.audio is not None else sound.device if isinstance(sound, RealSoundSpec) else ""
        )
        return SoundMasker(
            device, level.dbfs, level_dba=level.dba, seed=seed, sample_rate_hz=rate_hz, clock=self.clock
        )

    def _responder(self, terminal: "Terminal") -> "Responder":
        from autd_trials.responses.keyboard import KeyboardResponder
        from autd_trials.responses.serial_box import SerialBox

        spec = self.rig.responses
        if isinstance(spec, SerialSpec):
            return SerialBox(spec.port, spec.protocol, self.clock)
        return KeyboardResponder(terminal, spec.keys)


def _on_the_clock(used: Used, clock: Clock) -> list[tuple[float, float]]:
    """Return when bursts began and ended on the host's clock, none of them later than now."""
    now_s, utc = clock.now_s(), clock.utc_now()
    ahead_s = max((0.0, *((end - utc).total_seconds() for _, end in used.bursts)))  # the clock was put back
    return [
        (now_s + (onset - utc).total_seconds() - ahead_s, now_s + (end - utc).total_seconds() - ahead_s)
        for onset, end in used.bursts
    ]


def _headphones(sound: EmulatedSoundSpec | RealSoundSpec | None) -> "Headphones | None":
    from autd_trials.masking.level import Headphones

    if not isinstance(sound, RealSoundSpec) or sound.headphones is None:
        return None
    spec = sound.headphones
    return Headphones(spec.sensitivity_db_per_v, spec.full_scale_v_rms, spec.checked, spec.note)
