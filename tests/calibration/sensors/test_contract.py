"""What every sensor does: it is entered, gives frames of its camera in order, and is left."""

import json
import threading
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autd_trials.calibration.provenance import Capture
from autd_trials.calibration.rigid import RigidMotion
from autd_trials.calibration.sensors.frame import Frame, Sensor
from autd_trials.calibration.sensors.hand import hand_path
from autd_trials.calibration.sensors.realsense import RealSenseSensor, load_sdk
from autd_trials.calibration.sensors.replay import RecordingSensor, ReplaySensor
from autd_trials.calibration.sensors.synthetic import SyntheticSensor
from autd_trials.errors import DeviceError, UsageError
from tests.calibration.full_disk import largest_file

MakeSensor = Callable[[], Sensor]

NOW = datetime(2026, 11, 20, 9, tzinfo=UTC)


def synthetic(frames: int | None = 5) -> SyntheticSensor:
    generator = np.random.default_rng(1)
    path = hand_path(np.array([0.0, 0.0, 1000.0]), 200, 500, generator)
    return SyntheticSensor(RigidMotion.identity(), path, 12.0, generator, frames=frames)


class SoftwareCamera:
    """The SDK's software device, into which frames are put while it runs."""

    def __init__(self) -> None:
        self.sdk = load_sdk()
        self.device = self.sdk.software_device()
        self.device.register_info(self.sdk.camera_info.serial_number, "software-1")
        self._camera = self.device.add_sensor("Stereo Module")
        streams = self.sdk.stream
        self._depth = self._add_stream(streams.depth, 0, self.sdk.format.z16, 2)
        self._infrared = self._add_stream(streams.infrared, 1, self.sdk.format.y8, 1)
        self._camera.add_read_only_option(self.sdk.option.depth_units, 0.001)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        self._over.set()
        if self._thread.ident is not None:
            self._thread.join()

    def _run(self) -> None:
        number = 0
        while not self._over.wait(0.005):
            number += 1
            self._put(self._depth, np.full((424, 512), 1000 + number, np.uint16), number, 2)
            self._put(self._infrared, np.full((424, 512), number % 256, np.uint8), number, 1)

    def _add_stream(self, kind: Any, index: int, form: Any, bytes_per_pixel: int) -> Any:
        camera = self.sdk.intrinsics()
        camera.width, camera.height = 512, 424
        camera.fx = camera.fy = 366.0
        camera.ppx, camera.ppy = 256.0, 212.0
        stream = self.sdk.video_stream()
        stream.type, stream.index, stream.uid, stream.fmt = kind, index, index, form
        stream.width, stream.height, stream.fps, stream.bpp = 512, 424, 30, bytes_per_pixel
        stream.intrinsics = camera
        return self._camera.add_video_stream(stream)

    def _put(self, profile: Any, pixels: Any, number: int, bytes_per_pixel: int) -> None:
        frame = self.sdk.software_video_frame()
        frame.stride, frame.bpp, frame.pixels = 512 * bytes_per_pixel, bytes_per_pixel, pixels
        frame.timestamp, frame.frame_number = 1000 + number * 5.0, number
        frame.domain = self.sdk.timestamp_domain.system_time
        frame.profile = profile.as_video_stream_profile()
        if bytes_per_pixel == 2:
            frame.depth_units = 0.001
        self._camera.on_video_frame(frame)


@pytest.fixture
def software_camera() -> Iterator[SoftwareCamera]:
    try:
        camera = SoftwareCamera()
    except UsageError as error:
        pytest.skip(str(error))
    yield camera
    camera.stop()


@pytest.fixture(params=["synthetic", "recording", "replay", "realsense"])
def make_sensor(request: pytest.FixtureRequest, tmp_path: Path) -> MakeSensor:
    """Return what makes a sensor of each kind."""
    if request.param == "realsense":
        camera = request.getfixturevalue("software_camera")

        def realsense() -> Sensor:
            camera.start()
            return RealSenseSensor(camera.device)

        return realsense
    if request.param == "recording":
        return lambda: RecordingSensor(synthetic(), tmp_path / "recording", NOW)
    if request.param == "replay":
        with RecordingSensor(synthetic(), tmp_path / "recording", NOW) as recording:
            list(recording)
        return lambda: ReplaySensor(tmp_path / "recording")
    return synthetic


def test_frames_come_in_order_with_the_cameras_size(make_sensor: MakeSensor) -> None:
    with make_sensor() as sensor:
        frames = list(islice(sensor, 4))
    assert len(frames) == 4
    for frame in frames:
        assert (
            frame.infrared.shape == frame.depth_m.shape == (sensor.intrinsics.height, sensor.intrinsics.width)
        )
        assert frame.infrared.dtype == np.uint16
        assert frame.depth_m.dtype == np.float32
    for earlier, later in pairwise(frames):
        assert later.time_s > earlier.time_s
        assert later.sequence > earlier.sequence
        assert later.clock == earlier.clock
    assert sensor.capture.sensor
    assert sensor.capture.serial
    assert sensor.capture.origin == "simulated"


def test_pixels_and_rays_are_each_others_inverse(make_sensor: MakeSensor) -> None:
    with make_sensor() as sensor:
        point = np.array([120.0, -80.0, 950.0])
        assert 950 * sensor.intrinsics.ray(*sensor.intrinsics.project(point)) == pytest.approx(point)


def test_a_recording_gives_the_same_frames_again(tmp_path: Path) -> None:
    with RecordingSensor(synthetic(), tmp_path / "r", NOW) as recording:
        recorded = list(recording)
    played = list(ReplaySensor(tmp_path / "r"))
    assert [f.time_s for f in played] == [f.time_s for f in recorded]
    for first, second in zip(recorded, played, strict=True):
        assert (first.infrared == second.infrared).all()
        assert (first.depth_m == second.depth_m).all()
        assert (first.clock, first.sequence) == (second.clock, second.sequence)


def test_a_recording_is_never_written_over(tmp_path: Path) -> None:
    with RecordingSensor(synthetic(), tmp_path / "r", NOW) as recording:
        next(iter(recording))
    with pytest.raises(UsageError, match="holds a recording already"):
        RecordingSensor(synthetic(), tmp_path / "r", NOW)


def test_a_recording_that_was_cut_off_plays_up_to_there(tmp_path: Path) -> None:
    with RecordingSensor(synthetic(), tmp_path / "r", NOW) as recording:
        list(recording)
    last = tmp_path / "r" / "000004.npz"
    last.write_bytes(last.read_bytes()[:500])
    assert len(list(ReplaySensor(tmp_path / "r"))) == 4
    middle = tmp_path / "r" / "000002.npz"
    middle.write_bytes(b"nonsense")
    with pytest.raises(UsageError, match=r"000002\.npz: this frame cannot be read"):
        list(ReplaySensor(tmp_path / "r"))


def test_a_folder_without_recording_is_told(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="this is no recording"):
        ReplaySensor(tmp_path)
    (tmp_path / "recording.json").write_text("{}")
    with pytest.raises(UsageError, match="this is no recording"):
        ReplaySensor(tmp_path)


def test_depth_goes_through_the_sdk_unchanged(software_camera: SoftwareCamera) -> None:
    software_camera.start()
    with RealSenseSensor(software_camera.device) as sensor:
        frames: list[Frame] = list(islice(sensor, 3))
    assert sensor.capture == Capture(origin="simulated", sensor="realsense", serial="software-1")
    for frame in frames:
        assert frame.depth_m[200, 300] == pytest.approx((1000 + frame.sequence) / 1000, abs=1e-6)
        assert frame.infrared[5, 5] == frame.sequence % 256
        assert frame.time_s == pytest.approx((1000 + frame.sequence * 5) / 1000)
        assert frame.clock == "system"


def test_a_camera_without_infrared_is_told() -> None:
    try:
        device = load_sdk().software_device()
    except UsageError as error:
        pytest.skip(str(error))
    device.add_sensor("Color")
    with pytest.raises(DeviceError, match="no depth and left infrared stream"):
        RealSenseSensor(device)


def test_a_replay_is_as_old_as_its_recording_and_simulated_if_its_sensor_was(tmp_path: Path) -> None:
    with RecordingSensor(synthetic(), tmp_path / "r", NOW) as recording:
        list(recording)
    played = ReplaySensor(tmp_path / "r")
    assert played.capture == Capture(origin="simulated", sensor="synthetic", serial="synthetic", taken=NOW)
    with RecordingSensor(played, tmp_path / "again", NOW + timedelta(days=9)) as again:
        list(again)
    assert ReplaySensor(tmp_path / "again").capture == played.capture


@pytest.mark.parametrize(("serial", "origin"), [("synthetic", "simulated"), ("73", "unknown")])
def test_a_recording_of_version_1_says_a_serial_number_only(tmp_path: Path, serial: str, origin: str) -> None:
    camera = {"width": 4, "height": 3, "fx": 5.0, "fy": 5.0, "cx": 2.0, "cy": 1.5}
    (tmp_path / "recording.json").write_text(json.dumps({"serial": serial, "intrinsics": camera}))
    capture = ReplaySensor(tmp_path).capture
    assert (capture.origin, capture.serial, capture.at(NOW).taken) == (
        origin,
        serial,
        NOW if origin == "simulated" else None,
    )


@pytest.mark.parametrize(
    "wrong",
    [
        {"width": 0},
        {"height": 10**9},
        {"fx": 0.0},
        {"cx": float("nan")},
        {"width": "4"},
        {"depth": 3},
    ],
)
def test_a_recording_of_an_impossible_camera_is_told(tmp_path: Path, wrong: dict[str, object]) -> None:
    camera = {"width": 4, "height": 3, "fx": 5.0, "fy": 5.0, "cx": 2.0, "cy": 1.5}
    (tmp_path / "recording.json").write_text(json.dumps({"serial": "7", "intrinsics": camera | wrong}))
    with pytest.raises(UsageError, match="this is no recording"):
        ReplaySensor(tmp_path)


def test_a_full_disk_ends_a_recording_of_frames_with_what_is_safe(tmp_path: Path) -> None:
    taken = []
    with RecordingSensor(synthetic(), tmp_path / "r", NOW) as recording:
        frames = iter(recording)
        taken += [next(frames), next(frames)]
        with largest_file(1000), pytest.raises(DeviceError, match="the disk does not take this") as caught:
            next(frames)
    assert "frames 0 to 1 are safe there" in str(caught.value.do)
    assert [frame.time_s for frame in ReplaySensor(tmp_path / "r")] == [frame.time_s for frame in taken]


@given(place=st.integers(0, 10_000), byte=st.integers(0, 255))
def test_a_damaged_frame_is_a_frame_or_is_told(
    tmp_path_factory: pytest.TempPathFactory, recorded_bytes: tuple[bytes, bytes], place: int, byte: int
) -> None:
    folder = tmp_path_factory.mktemp("recording")
    header, frame = recorded_bytes
    damaged = bytearray(frame)
    damaged[place % len(frame)] = byte
    (folder / "recording.json").write_bytes(header)
    (folder / "000000.npz").write_bytes(damaged)
    (folder / "000001.npz").write_bytes(frame)
    assert played(folder) in ("2 frames", str(folder / "000000.npz"))


def played(folder: Path) -> str:
    try:
        return f"{len(list(ReplaySensor(folder)))} frames"
    except UsageError as error:
        return str(error.where)


@pytest.fixture(scope="module")
def recorded_bytes(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, bytes]:
    """Header and one frame of a recording of a small camera."""
    folder = tmp_path_factory.mktemp("recorded")
    camera = {"width": 4, "height": 3, "fx": 5.0, "fy": 5.0, "cx": 2.0, "cy": 1.5}
    header = json.dumps({"serial": "7", "intrinsics": camera}).encode()
    pixels = np.arange(12).reshape(3, 4)
    np.savez_compressed(
        folder / "0.npz",
        infrared=pixels.astype(np.uint16),
        depth_m=pixels.astype(np.float32),
        time_s=1.0,
        clock="system",
        sequence=1,
    )
    return header, (folder / "0.npz").read_bytes()
