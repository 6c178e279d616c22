"""Read one binary file of other programs, as a process of its own: `python -P reader_process.py KIND ARGUMENTS > TABLES.npz`.

Malformed files crash the libraries that read them or make them ask for any amount of memory; here that ends this
process alone. It imports nothing of Farhand, so that it starts quickly and anywhere. What goes wrong is the last
line of stderr. The output has the arrays `0`, `1`, ... of shape (T, C), and `about`: JSON, an object for each with
`recording` (its number), `name`, `headers`, `rows`, and where they are known `parent`, `units`, `order`.
"""

# pyright: reportMissingImports=false
# The libraries are optional.
from __future__ import annotations

import json
import os
import sys
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

_MAX_NUMBERS = 6_000_000
_POSES = {
    "geometry_msgs/msg/PoseStamped": lambda message: message.pose,
    "geometry_msgs/msg/PoseWithCovarianceStamped": lambda message: message.pose.pose,
    "nav_msgs/msg/Odometry": lambda message: message.pose.pose,
    "geometry_msgs/msg/PointStamped": lambda message: message,
    "geometry_msgs/msg/TransformStamped": lambda message: message.transform,
    "tf2_msgs/msg/TFMessage": None,
}
_POSE_HEADERS = ["t [ns]", "x [m]", "y [m]", "z [m]", "qx", "qy", "qz", "qw"]

Tables = list[tuple[dict[str, Any], Any]]


def lasa(content: bytes) -> Tables:
    """Return the strokes of a MATLAB file of the LASA data set."""
    from scipy.io import loadmat

    _limit(memory_bytes=256_000_000, work_s=4)
    found = loadmat(BytesIO(content), simplify_cells=True)["demos"]
    tables = Tables()
    for number, demo in enumerate([found] if isinstance(found, dict) else list(found), start=1):
        numbers = np.column_stack([np.ravel(demo["t"]), np.asarray(demo["pos"], dtype=float).T])
        tables.append(({"recording": number, "name": "", "headers": ["t [s]", "x [mm]", "y [mm]"]}, numbers))
    return tables


def bag(path: str) -> Tables:
    """Return the poses of every topic, and of every TF frame within its parent, of a rosbag2 or an MCAP file."""
    from rosbags.rosbag2 import Reader
    from rosbags.typesys import Stores, get_typestore

    _limit()
    store = get_typestore(Stores.ROS2_HUMBLE)
    rows: dict[str, list[tuple[float, ...]]] = {}
    parents: dict[str, str] = {}
    counts: dict[str, int] = {}
    with Reader(path) as reader:
        connections = [c for c in reader.connections if c.msgtype in _POSES]
        if not connections:
            has = ", ".join(sorted({f"{c.topic} ({c.msgtype})" for c in reader.connections})[:8]) or "nothing"
            raise ValueError(f"a topic with PoseStamped, TransformStamped or TF; it has {has}")
        for connection, received_ns, data in reader.messages(connections):
            topic = connection.topic
            counts[topic] = number = counts.get(topic, 0) + 1
            message = store.deserialize_cdr(data, connection.msgtype)
            for child, each, pose in _poses(topic, connection.msgtype, message):
                parent = each.header.frame_id.lstrip("/")
                if parents.setdefault(child, parent) != parent:
                    raise ValueError(
                        f"message {number} of {topic} has {child} in {parent!r}, earlier ones in {parents[child]!r}"
                    )
                stamp_ns = each.header.stamp.sec * 1_000_000_000 + each.header.stamp.nanosec
                rows.setdefault(child, []).append((number, stamp_ns or received_ns, *pose))
                if 9 * sum(counts.values()) > _MAX_NUMBERS:
                    raise ValueError(f"at most {_MAX_NUMBERS} numbers of poses: cut the bag into several")
    return [
        ({"recording": 1, "name": child, "headers": _POSE_HEADERS, "row": "message", "parent": parents[child],
          "rows": [int(row[0]) for row in found]}, np.array([row[1:] for row in found], dtype=float))
        for child, found in rows.items()
    ]  # fmt: skip


def _poses(topic: str, kind: str, message: Any) -> list[tuple[str, Any, tuple[float, ...]]]:
    """Return the name, the stamped message and the numbers of each pose of a message; zeros for no orientation."""
    if kind == "tf2_msgs/msg/TFMessage":
        stamped = [(each.child_frame_id.lstrip("/"), each, each.transform) for each in message.transforms]
    else:
        stamped = [(topic, message, _POSES[kind](message))]
    found = []
    for name, each, pose in stamped:
        p = getattr(pose, "position", None) or getattr(pose, "translation", None) or pose.point
        q = getattr(pose, "orientation", None) or getattr(pose, "rotation", None)
        found.append((name, each, (p.x, p.y, p.z, *((q.x, q.y, q.z, q.w) if q else (0.0,) * 4))))
    return found


def lerobot(folder: str, *only: str) -> Tables:
    """Return the numbers of each episode of a LeRobot data set."""
    os.environ["ARROW_DEFAULT_MEMORY_POOL"] = "system"  # the others reserve more than the limit
    import pyarrow as pa
    import pyarrow.parquet as pq

    pa.set_cpu_count(1)
    pa.set_io_thread_count(1)
    _limit()
    info = json.loads((Path(folder) / "meta" / "info.json").read_text(encoding="utf-8"))
    if not str(info.get("codebase_version")).startswith("v3."):
        raise ValueError(
            f"codebase_version v3 in meta/info.json, got {info.get('codebase_version')!r}: convert it with lerobot"
        )
    wanted = {
        name: feature for name, feature in info["features"].items()
        if feature["dtype"] in ("float32", "float64", "int64", "int32") and len(feature["shape"]) == 1
    }  # fmt: skip
    headers = [header for name, feature in wanted.items() for header in _feature_headers(name, feature)]
    files = sorted(Path(folder).glob("data/*/*.parquet"))
    if not files:
        raise ValueError("data/chunk-*/file-*.parquet, got none: is the data set downloaded as a whole?")
    filters = [("episode_index", "in", [int(n) for n in only])] if only else None
    parts, left = [], _MAX_NUMBERS // max(1, len(headers))
    for file in files:
        if not only and pq.read_metadata(file).num_rows > left:
            raise ValueError(f"at most {_MAX_NUMBERS} numbers at once: choose episodes with --only")
        table = pq.read_table(file, columns=list(wanted), filters=filters, use_threads=False)
        left -= table.num_rows
        parts.append(
            np.column_stack([_feature(table, name, f["shape"][0], file) for name, f in wanted.items()])
        )
    numbers = np.concatenate(parts)
    index, frame = headers.index("episode_index"), headers.index("frame_index")
    return [
        ({"recording": int(episode), "name": "", "headers": headers, "row": "frame",
          "rows": numbers[numbers[:, index] == episode][:, frame].astype(int).tolist()}, numbers[numbers[:, index] == episode])
        for episode in np.unique(numbers[:, index])
    ]  # fmt: skip


def _feature_headers(name: str, feature: dict[str, Any]) -> list[str]:
    (n,) = feature["shape"]
    names = feature.get("names")
    if isinstance(names, dict):
        names = next(iter(names.values()), None)
    if n == 1:
        return [name]
    if isinstance(names, list) and len(names) == n:
        return [f"{name}.{each}" for each in names]
    return [f"{name}[{k}]" for k in range(n)]


def _feature(table: Any, name: str, width: int, file: Path) -> Any:
    column = table.column(name)
    values = column.combine_chunks()
    values = values.flatten() if hasattr(values, "flatten") else values  # what is a list in every row
    numbers = np.asarray(values.to_numpy(zero_copy_only=False), dtype=float)
    if numbers.size != table.num_rows * width:
        raise ValueError(f"{width} numbers of {name} in every row of {file.parent.name}/{file.name}")
    return numbers.reshape(-1, width)


def robomimic(path: str, *only: str) -> Tables:
    """Return the numbers of each demonstration of a robomimic file."""
    import h5py

    _limit()
    tables = Tables()
    with h5py.File(path, "r") as file:
        data: Any = file["data"]
        rate_hz = json.loads(data.attrs.get("env_args", "{}")).get("env_kwargs", {}).get("control_freq")
        names = [name for name in data if name.startswith("demo_") and name[5:].isdecimal()]
        for name in sorted(names, key=lambda name: int(name[5:])):
            if only and name[5:] not in only:
                continue
            found = {"actions": data[name].get("actions")}
            group = data[name].get("obs", {})
            # Nothing is followed out of this file.
            found |= {
                f"obs/{key}": group[key]
                for key in group
                if isinstance(group.get(key, getlink=True), h5py.HardLink)
            }
            tables.append(_demo(int(name[5:]), found, rate_hz))
    if not tables:
        raise ValueError(
            "demonstrations data/demo_0 and so on, got none" + (" of these numbers" if only else "")
        )
    return tables


def _demo(number: int, found: dict[str, Any], rate_hz: float | None) -> tuple[dict[str, Any], Any]:
    arrays = {
        name: np.asarray(each[()], dtype=float) for name, each in found.items()
        if hasattr(each, "dtype") and each.dtype.kind in "fiu" and 1 <= each.ndim <= 2 and each.shape[-1] <= 10_000
        and not each.is_virtual and each.external is None
    }  # fmt: skip
    rows = {len(array) for array in arrays.values()}
    if len(rows) != 1:
        raise ValueError(f"data of one length in demo_{number}, got {sorted(rows) or 'none'}")
    headers = [
        f"{name}[{k}]"
        for name, array in arrays.items()
        for k in range(array.shape[1] if array.ndim > 1 else 1)
    ]
    columns = np.column_stack(list(arrays.values()))
    if rate_hz:
        headers, columns = ["t [s]", *headers], np.column_stack([np.arange(len(columns)) / rate_hz, columns])
    about = {"recording": number, "name": "", "headers": headers, "row": "step", "order": "xyzw"}
    return {**about, "rows": list(range(len(columns)))}, columns


def _limit(memory_bytes: int = 512_000_000, work_s: int = 60) -> None:
    """Give this process so much memory and time, beyond what it has taken to start."""
    import resource

    taken = Path("/proc/self/statm")
    if taken.exists():  # elsewhere the limit of time has to do
        used = int(taken.read_text(encoding="utf-8").split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + memory_bytes, used + memory_bytes))
    spent_s = int(resource.getrusage(resource.RUSAGE_SELF).ru_utime)
    resource.setrlimit(resource.RLIMIT_CPU, (spent_s + work_s, spent_s + work_s + 1))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def main(kind: str, *arguments: str) -> None:
    """Write the tables of one file."""
    tables = (
        lasa(sys.stdin.buffer.read())
        if kind == "lasa"
        else {"bag": bag, "lerobot": lerobot, "robomimic": robomimic}[kind](*arguments)
    )
    about = np.array(json.dumps([about for about, _ in tables]))
    out = BytesIO()
    np.savez(
        out, allow_pickle=False, about=about, **{str(n): numbers for n, (_, numbers) in enumerate(tables)}
    )
    sys.stdout.buffer.write(out.getvalue())


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except ModuleNotFoundError as error:
        extra = {"bag": "rosbag", "lerobot": "lerobot", "robomimic": "robomimic"}.get(sys.argv[1], "")
        sys.exit(
            f"the package {str(error.name).partition('.')[0]} is not installed: pip install 'farhand[{extra}]'"
        )
    except Exception as error:
        sys.exit(" ".join(str(error).split())[:400] or type(error).__name__)
