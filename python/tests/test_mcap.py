"""MCAP files of a scan, read by two programs that share no code with what wrote them or with each other."""

from __future__ import annotations

import json
import os
import subprocess

import numpy as np
import pytest
from conftest import needs

import sheetlight

FIELDS = ["x", "y", "z", "intensity", "sigma", "quality", "u", "v", "shot"]
TYPES = {
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    "/sheetlight/camera_info": "sensor_msgs/msg/CameraInfo",
    "/sheetlight/cloud": "sensor_msgs/msg/PointCloud2",
    "/sheetlight/part": "geometry_msgs/msg/PoseStamped",
    "/sheetlight/picture": "sensor_msgs/msg/Image",
    "/sheetlight/profile": "sensor_msgs/msg/PointCloud2",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
}
PART = np.array([[0, -1, 0, 12.5], [1, 0, 0, -3.25], [0, 0, 1, 40], [0, 0, 0, 1.0]])


@pytest.fixture(scope="module")
def bag(by_program, made, tmp_path_factory):
    """The file that the program makes of its scan, with everything in it."""
    folder = tmp_path_factory.mktemp("mcap")
    part = folder / "part.json"
    found = {"recipe": "plate", "frame": "base", "passed": True, "reasons": [], "base_from_part": PART.ravel().tolist()}
    part.write_text(json.dumps(found))
    out = folder / "scan.mcap"
    arguments = ["mcap", by_program, "--recording", made.recording().folder, "--station", made.station.folder]
    arguments += ["--pictures", "--part", part, "--out", out]
    subprocess.run([os.environ["SHEETLIGHT_PROGRAM"], *map(str, arguments)], check=True, capture_output=True)
    return out


def by_mcap(file):
    """(topic, type, time in ns, message) of every message, decoded by the definitions that the file carries."""
    needs("mcap")
    needs("mcap_ros2")
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        header = reader.get_header()
        assert header.profile == "ros2" and header.library.startswith("sheetlight ")
        return [(c.topic, s.name, m.log_time, d) for s, c, m, d in reader.iter_decoded_messages(log_time_order=False)]


def by_rosbags(file):
    """The same, decoded by the definitions that the file carries, and by those of ROS 2 that the package has."""
    needs("rosbags")
    from rosbags.rosbag2 import Reader
    from rosbags.typesys import Stores, get_typestore, get_types_from_msg

    own, known = get_typestore(Stores.EMPTY), get_typestore(Stores.ROS2_JAZZY)
    found = []
    with Reader(file) as reader:
        for c in reader.connections:
            own.register(get_types_from_msg(c.msgdef.data, c.msgtype))
        for c, time, raw in reader.messages():
            message = known.deserialize_cdr(raw, c.msgtype)
            assert repr(own.deserialize_cdr(raw, c.msgtype)) == repr(message)
            assert bytes(known.serialize_cdr(message, c.msgtype)) == bytes(raw), c.topic
            found.append((c.topic, c.msgtype, time, message))
    return found


@pytest.fixture(scope="module", params=[by_mcap, by_rosbags], ids=["mcap-ros2-support", "rosbags"])
def read(request, bag):
    """Messages by topic, in order, each with its time."""
    topics = {}
    for topic, kind, time, message in request.param(bag):
        assert TYPES[topic] == kind
        topics.setdefault(topic, []).append((time, message))
    assert topics.keys() == TYPES.keys()
    return topics


def points(message) -> np.ndarray:
    kinds = {6: "<u4", 7: "<f4"}
    kind = np.dtype({
        "names": [f.name for f in message.fields],
        "formats": [kinds[f.datatype] for f in message.fields],
        "offsets": [f.offset for f in message.fields],
        "itemsize": message.point_step,
    })
    assert message.is_dense and not message.is_bigendian and message.row_step == message.width * message.point_step
    return np.frombuffer(bytes(message.data), kind, count=message.width * message.height)


def same_points(read: np.ndarray, true: np.ndarray) -> None:
    assert list(read.dtype.names) == FIELDS and len(read) == len(true)
    for name in ("x", "y", "z", "sigma"):
        metres = true[name].astype(np.float64) / 1000
        step = np.spacing(np.abs(metres).astype(np.float32))
        assert (np.abs(read[name] - metres) <= step).all(), name
    for name in ("intensity", "quality", "u", "v", "shot"):
        assert (read[name] == true[name]).all(), name


def stamp(header) -> int:
    nanosec = header.stamp.nanosec
    return header.stamp.sec * 1_000_000_000 + nanosec


def matrix(position, q) -> np.ndarray:
    """Of a position in metres and a quaternion: mm."""
    rotation = needs("scipy.spatial.transform").Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix()
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = rotation, 1000 * np.array([position.x, position.y, position.z])
    return whole


def test_profiles_and_cloud_are_those_of_cloud_ply(read, by_program):
    true = sheetlight.Scan.open(by_program).points
    ((_, cloud),) = read["/sheetlight/cloud"]
    assert cloud.header.frame_id == "base" and cloud.height == 1
    same_points(points(cloud), true)
    shots = np.unique(true["shot"])
    assert len(read["/sheetlight/profile"]) == len(shots) > 80
    for (time, message), shot in zip(read["/sheetlight/profile"], shots):
        same_points(points(message), true[true["shot"] == shot])
        assert stamp(message.header) == time


def test_the_camera_is_where_the_scan_has_it(read, by_program, made):
    scan = sheetlight.Scan.open(by_program)
    poses = dict(enumerate(pose for _, pose in made.recording()))
    assert len(read["/tf"]) == len(scan.camera_places) == 120
    for (time, message), (shot, place) in zip(read["/tf"], scan.camera_places):
        camera, flange = message.transforms
        assert (camera.header.frame_id, camera.child_frame_id) == ("base", "camera")
        assert (flange.header.frame_id, flange.child_frame_id) == ("base", "flange")
        assert stamp(camera.header) == stamp(flange.header) == time
        assert np.allclose(matrix(camera.transform.translation, camera.transform.rotation), place, rtol=0, atol=1e-9)
        assert np.allclose(matrix(flange.transform.translation, flange.transform.rotation), poses[shot],
                           rtol=0, atol=1e-9)
    ((_, static),) = read["/tf_static"]
    names = [(t.header.frame_id, t.child_frame_id) for t in static.transforms]
    assert names == [("camera", "laser"), ("flange", "camera_reported")]


def test_pictures_cameras_parts_and_figures(read, arrays, made):
    pictures, _ = arrays
    for (_, message), true in zip(read["/sheetlight/picture"], pictures):
        assert (message.encoding, message.height, message.width, message.step) == ("mono8", 480, 640, 640)
        assert (np.frombuffer(bytes(message.data), np.uint8).reshape(480, 640) == true).all()
    assert len(read["/sheetlight/picture"]) == len(read["/sheetlight/camera_info"]) == len(pictures)
    camera = made.station.camera.value
    for _, message in read["/sheetlight/camera_info"]:
        assert (message.distortion_model, message.width, message.height) == ("plumb_bob", 640, 480)
        k, d = (getattr(message, name, getattr(message, name.upper(), None)) for name in "kd")
        assert np.array_equal(np.reshape(k, (3, 3)), camera.matrix)
        assert np.array_equal(d, np.ravel(camera.distortion)[:5])
    ((_, part),) = read["/sheetlight/part"]
    assert np.allclose(matrix(part.pose.position, part.pose.orientation), PART, rtol=0, atol=1e-12)
    ((_, figures),) = read["/diagnostics"]
    (status,) = figures.status
    values = {v.key: v.value for v in status.values}
    ((_, cloud),) = read["/sheetlight/cloud"]
    assert values["points"] == str(cloud.width) and float(values["median_sigma_mm"]) > 0
