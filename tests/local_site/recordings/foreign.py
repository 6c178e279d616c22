"""Writers of foreign recordings, by the formats' own libraries or byte by byte."""

# pyright: reportMissingImports=false
from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from tests.local_site.recordings.truth import POSITIONS_M, QUATS_WXYZ, SAMPLES, TIMES_S, N

STORE = get_typestore(Stores.ROS2_HUMBLE)
TYPES: dict[str, Any] = STORE.types
EPOCH_S = 1_700_000_000


def stamped(t: float, frame: str) -> Any:
    stamp = TYPES["builtin_interfaces/msg/Time"](sec=EPOCH_S, nanosec=round(1e9 * t))
    return TYPES["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def pose(t: float, p, q, frame: str = "world") -> Any:
    point = TYPES["geometry_msgs/msg/Point"](*map(float, p))
    turn = TYPES["geometry_msgs/msg/Quaternion"](x=q[1], y=q[2], z=q[3], w=q[0])
    return TYPES["geometry_msgs/msg/PoseStamped"](
        stamped(t, frame), TYPES["geometry_msgs/msg/Pose"](point, turn)
    )


def transform(t: float, p, q, parent: str, child: str) -> Any:
    offset = TYPES["geometry_msgs/msg/Vector3"](*map(float, p))
    turn = TYPES["geometry_msgs/msg/Quaternion"](x=q[1], y=q[2], z=q[3], w=q[0])
    moved = TYPES["geometry_msgs/msg/Transform"](offset, turn)
    return TYPES["geometry_msgs/msg/TransformStamped"](stamped(t, parent), child, moved)


def tf(*transforms: Any) -> Any:
    return TYPES["tf2_msgs/msg/TFMessage"](list(transforms))


STILL, HALF_TURN = (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
Messages = list[tuple[str, float, Any]]
"""Topic, time of arrival and message."""
POSES: Messages = [("/plug/pose", t, pose(t, p, q)) for t, p, q in SAMPLES]
SOCKET: Messages = [("/tf_static", 0.0, tf(transform(0.0, (0.2, 0.2, 0.1), HALF_TURN, "world", "socket")))]
# The hand stands where the arm's base turns it: half a turn about z, and 1 m up.
CHAIN: Messages = [
    ("/tf_static", 0.0, tf(transform(0.0, (0.0, 0.0, 1.0), HALF_TURN, "world", "base"))),
    *(("/tf", t, tf(transform(t, (-p[0], -p[1], p[2] - 1.0), STILL, "base", "hand"))) for t, p, _ in SAMPLES),
    ("/tf_static", 0.0, tf(transform(0.0, (0.0, 0.0, 0.0), HALF_TURN, "hand", "tool"))),
]  # fmt: skip


def bag(folder: Path, messages: Messages, storage: StoragePlugin = StoragePlugin.SQLITE3) -> Path:
    with Writer(folder, version=9, storage_plugin=storage) as writer:
        connections: dict[str, Any] = {}
        for topic, t, message in messages:
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            arrived_ns = EPOCH_S * 10**9 + round(1e9 * t) + 3_000_000  # later than its stamp
            writer.write(connections[topic], arrived_ns, STORE.serialize_cdr(message, kind))
    return folder


def by_hand(file: Path, compress: bool, ending: bool = True) -> Path:
    """An MCAP of the poses whose CDR is packed byte by byte: header, frame "map" and seven doubles, each at its alignment."""
    with file.open("wb") as stream:
        writer = McapWriter(stream) if compress else McapWriter(stream, use_chunking=False)
        writer.start(profile="ros2", library="by hand")
        schema = writer.register_schema("geometry_msgs/msg/PoseStamped", "ros2msg", b"")
        channel = writer.register_channel("/plug", "cdr", schema)
        for t, p, q in SAMPLES:
            head = struct.pack("<iII4s", EPOCH_S, round(1e9 * t), 4, b"map\0")
            data = b"\0\1\0\0" + head + struct.pack("<7d", *p, q[1], q[2], q[3], q[0])
            writer.add_message(channel, 10**9 * EPOCH_S, data, 10**9 * EPOCH_S)
        if ending:
            writer.finish()
    return file


def lerobot(folder: Path, names: Any, version: str = "v3.0", order: str = "wxyz", per_file: int = 2) -> Path:
    """A data set of three episodes, each further along x by its number; its parquet files hold two episodes at most."""
    state = [[*p, *q] for _, p, q in SAMPLES]
    features = {
        "observation.state": {"dtype": "float64", "shape": [7], "names": names},
        "observation.images.top": {"dtype": "video", "shape": [480, 640, 3], "names": None},
        **{n: {"dtype": "float32", "shape": [1], "names": None} for n in ("timestamp", "next.reward")},
        **{
            n: {"dtype": "int64", "shape": [1], "names": None}
            for n in ("frame_index", "episode_index", "index")
        },
    }
    (folder / "meta").mkdir(parents=True)
    info = {"codebase_version": version, "fps": 20, "features": features}
    (folder / "meta" / "info.json").write_text(json.dumps(info))
    for first in range(0, 3, per_file):
        episodes = [n for n in range(first, min(3, first + per_file)) for _ in SAMPLES]
        columns = {
            "observation.state": pa.array(
                [[row[0] + episodes[n], *row[1:]] for n, row in enumerate(state * (len(episodes) // N))], pa.list_(pa.float64(), 7)
            ),
            "timestamp": pa.array(TIMES_S * (len(episodes) // N), pa.float32()),
            "next.reward": pa.array([0.0] * len(episodes), pa.float32()),
            "frame_index": pa.array([*range(N)] * (len(episodes) // N)),
            "episode_index": pa.array(episodes),
            "index": pa.array(range(len(episodes))),
        }  # fmt: skip
        file = folder / "data" / "chunk-000" / f"file-{first:03d}.parquet"
        file.parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(pa.table(columns), file)
    return folder


NAMED = ["x", "y", "z", "qw", "qx", "qy", "qz"]


def robomimic(file: Path, rate_hz: float | None = 20.0, **more: Any) -> Path:
    """Two demonstrations as robosuite writes them, quaternions x, y, z, w; the second one a metre further along x."""
    with h5py.File(file, "w") as content:
        data = content.create_group("data")
        data.attrs["env_args"] = json.dumps({"env_kwargs": {"control_freq": rate_hz} if rate_hz else {}})
        for n in range(2):
            demo = data.create_group(f"demo_{n}")
            demo["actions"] = np.zeros((N, 7))
            demo["obs/robot0_eef_pos"] = np.add(POSITIONS_M, [n, 0.0, 0.0])
            demo["obs/robot0_eef_quat"] = np.roll(QUATS_WXYZ, -1, axis=1)
            demo["obs/robot0_joint_pos"] = np.zeros((N, 7))
            demo["obs/agentview_image"] = np.zeros((N, 4, 4, 3), np.uint8)
            for name, value in more.items():
                demo[f"obs/{name}"] = value
    return file


def cut(file: Path) -> Path:
    content = file.read_bytes()
    file.write_bytes(content[: len(content) * 2 // 3])
    return file
