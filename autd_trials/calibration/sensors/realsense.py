"""Intel RealSense depth cameras through their SDK (extra ``realsense``; Debian package libusb-1.0-0).

Depth and left infrared imager are one camera. Tested with the SDK's software device into which frames are
put; no real camera was there.
"""

import importlib
from collections.abc import Iterator
from typing import Any, Self

import numpy as np

from autd_trials.calibration.provenance import Capture, Origin
from autd_trials.calibration.sensors.frame import Frame, Intrinsics
from autd_trials.errors import DeviceError, UsageError

_TIMEOUT_MS = 5000
_CLOCKS = {"system_time": "system", "global_time": "system", "hardware_clock": "hardware"}
_LEFT_IMAGER = 1
_QUEUED_FRAMES = 16


def find_realsense(serial: str | None) -> "RealSenseSensor":
    """Return the camera with a serial number, or the only one.

    Raises
    ------
    UsageError
        The SDK is not installed.
    DeviceError
        There is no such camera, or more than one and no serial number was given.
    """
    sdk = load_sdk()
    devices = {
        device.get_info(sdk.camera_info.serial_number): device for device in sdk.context().query_devices()
    }
    found = ", ".join(devices) or "none"
    if serial is None and len(devices) == 1:
        return RealSenseSensor(next(iter(devices.values())))
    if serial is None or serial not in devices:
        raise DeviceError(
            f"RealSense camera {serial or ''} not found; connected: {found}",
            do="connect it by USB 3, or name one of these: --sensor realsense:SERIAL",
        )
    return RealSenseSensor(devices[serial])


def load_sdk() -> Any:
    """Return the module of the SDK.

    Raises
    ------
    UsageError
        It is not installed, or the system lacks what it needs.
    """
    try:
        return importlib.import_module("pyrealsense2")
    except ImportError as error:
        raise UsageError(
            f"the RealSense SDK cannot be used: {error}",
            do="pip install 'autd-trials[realsense]', and apt install libusb-1.0-0",
        ) from error


class RealSenseSensor:
    """A camera of the SDK.

    Parameters
    ----------
    device
        The SDK's device.

    Raises
    ------
    DeviceError
        It has no depth and left infrared stream of one size.
    """

    def __init__(self, device: Any) -> None:
        self._sdk = load_sdk()
        self._device = device
        self._camera, self._profiles = _depth_and_infrared(self._sdk, device)
        depth = self._profiles[0].as_video_stream_profile().get_intrinsics()
        self.intrinsics = Intrinsics(depth.width, depth.height, depth.fx, depth.fy, depth.ppx, depth.ppy)
        self._frames = self._sdk.frame_queue(_QUEUED_FRAMES, keep_frames=True)

    @property
    def capture(self) -> Capture:
        """The camera; the SDK's software device is simulated, a file that it plays of unknown origin."""
        origin: Origin = "measured"
        if isinstance(self._device, self._sdk.software_device):
            origin = "simulated"
        elif self._device.is_playback():
            origin = "unknown"
        return Capture(origin=origin, sensor="realsense", serial=self._serial)

    @property
    def _serial(self) -> str:
        info = self._sdk.camera_info.serial_number
        return str(self._device.get_info(info)) if self._device.supports(info) else ""

    def __enter__(self) -> Self:
        try:
            self._camera.open(self._profiles)
            self._camera.start(self._frames)
        except RuntimeError as error:
            raise DeviceError(f"the camera does not start: {error}", where=self._serial) from error
        return self

    def __exit__(self, *error: object) -> None:
        self._camera.stop()
        self._camera.close()

    def __iter__(self) -> Iterator[Frame]:
        depth, infrared = None, None
        while True:
            try:
                frame = self._frames.wait_for_frame(_TIMEOUT_MS)
            except RuntimeError as error:
                raise DeviceError(
                    f"no frame came for {_TIMEOUT_MS / 1000:g} s: {error}",
                    where=self._serial,
                    do="see to its cable",
                ) from error
            if frame.is_depth_frame():
                depth = frame.as_depth_frame()
            else:
                infrared = frame.as_video_frame()
            if depth and infrared and depth.get_frame_number() == infrared.get_frame_number():
                yield Frame(
                    infrared=np.array(infrared.get_data(), dtype=np.uint16),
                    depth_m=np.array(depth.get_data(), dtype=np.float32) * np.float32(depth.get_units()),
                    time_s=depth.get_timestamp() / 1000,
                    clock=_CLOCKS[depth.get_frame_timestamp_domain().name],
                    sequence=int(depth.get_frame_number()),
                )
                depth, infrared = None, None


def _depth_and_infrared(sdk: Any, device: Any) -> tuple[Any, list[Any]]:
    """Return the SDK's sensor and its largest pair of depth and left infrared streams of one size."""
    pairs = []
    for camera in device.query_sensors():
        videos = (profile for profile in camera.profiles if profile.is_video_stream_profile())
        streams = [profile.as_video_stream_profile() for profile in videos]
        depths = [s for s in streams if s.stream_type() == sdk.stream.depth]
        infrareds = [
            s for s in streams if s.stream_type() == sdk.stream.infrared and s.stream_index() == _LEFT_IMAGER
        ]
        pairs += [
            (camera, depth, infrared)
            for depth in depths
            for infrared in infrareds
            if _shape(depth) == _shape(infrared)
        ]
    if not pairs:
        raise DeviceError("the camera has no depth and left infrared stream of one size and rate")
    camera, depth, infrared = max(pairs, key=lambda pair: _shape(pair[1]))
    return camera, [depth, infrared]


def _shape(stream: Any) -> tuple[int, int, int]:
    """Return what streams are compared by: 30 frames a second first, then the size."""
    return (-abs(stream.fps() - 30), stream.width(), stream.height())
