"""Writes what a lab would publish of one session as tables of every kind: write_tables.py OUT URDF BASE TIP.

The arm is the URDF with lengths and angles that are off; its kinematics are numpy's own. Each table holds the same poses.
"""

import json
import pathlib
import sys
import xml.etree.ElementTree as ElementTree

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.spatial.transform import Rotation

POSES, SEED = 80, 20261130


def numbers(element, name, default):
    return np.array([float(x) for x in (element.get(name) or default).split()]) if element is not None else np.array(
        [float(x) for x in default.split()]
    )


def matrix(position, rotation):
    placed = np.eye(4)
    placed[:3, :3], placed[:3, 3] = rotation.as_matrix(), position
    return placed


def chain(urdf, base, tip):
    """The joints from the base to the tip: name, place, axis (none where it is fixed), limits."""
    joints = {j.find("child").get("link"): j for j in ElementTree.parse(urdf).getroot().findall("joint")}
    way = []
    while tip != base:
        joint = joints[tip]
        origin = joint.find("origin")
        place = matrix(numbers(origin, "xyz", "0 0 0"), Rotation.from_euler("xyz", numbers(origin, "rpy", "0 0 0")))
        moves = joint.get("type") == "revolute"
        limit = joint.find("limit")
        limits = (float(limit.get("lower")), float(limit.get("upper"))) if moves else None
        axis = numbers(joint.find("axis"), "xyz", "1 0 0") if moves else None
        way.append((joint.get("name"), place, axis, limits))
        tip = joint.find("parent").get("link")
    return way[::-1]


def tip_of(way, angles):
    placed, angles = np.eye(4), iter(angles)
    for _, place, axis, _ in way:
        placed = placed @ place
        if axis is not None:
            placed = placed @ matrix(np.zeros(3), Rotation.from_rotvec(axis * next(angles)))
    return placed


def main():
    out, urdf, base, tip = pathlib.Path(sys.argv[1]), *sys.argv[2:5]
    random = np.random.default_rng(SEED)
    way = chain(urdf, base, tip)

    def off(place):
        turned = Rotation.from_rotvec(random.normal(0, np.radians(0.3), 3))
        return place @ matrix(random.normal(0, 5e-4, 3), turned)

    real = [(name, off(place), axis, limits) for name, place, axis, limits in way]
    names = [name for name, _, axis, _ in way if axis is not None]
    limits = np.array([limits for *_, limits in way if limits])
    middle, half = limits.mean(axis=1), 0.45 * (limits[:, 1] - limits[:, 0])
    joints = middle + random.uniform(-1, 1, (POSES, len(names))) * half
    tracker = matrix([1.2, -0.4, 0.3], Rotation.from_euler("xyz", [0.2, -0.1, 2.1]))
    marker = matrix([0.01, 0.02, 0.06], Rotation.from_euler("xyz", [0.3, 0.5, -0.7]))
    poses = np.array([tracker @ tip_of(real, q) @ marker for q in joints])
    poses[:, :3, 3] += random.normal(0, 2e-5, (POSES, 3))
    point, turned = poses[:, :3, 3], Rotation.from_matrix(poses[:, :3, :3])
    quaternion, vector = turned.as_quat(), turned.as_rotvec()
    rpy = turned.as_euler("xyz")

    def csv(name, header, *columns, delimiter=",", form="%.9f"):
        text = "" if header is None else delimiter.join(header) + "\n"
        rows = np.column_stack(columns)
        text += "".join(delimiter.join(form % x for x in row) + "\n" for row in rows)
        (out / name).write_text(text)

    out.mkdir(parents=True, exist_ok=True)
    counted = [f"q{k + 1}" for k in range(len(names))]
    csv("counted.csv", [*counted, *"xyz", "qx", "qy", "qz", "qw"], joints, point, quaternion)
    csv("named.csv", [f"{n} [deg]" for n in names] + ["X [mm]", "Y [mm]", "Z [mm]", "rx", "ry", "rz"],
        np.degrees(joints), 1e3 * point, vector, delimiter=";")
    csv("tabs.tsv", [*names, "tool_x_mm", "tool_y_mm", "tool_z_mm", "tool_roll_deg", "tool_pitch_deg", "tool_yaw_deg"],
        joints, 1e3 * point, np.degrees(rpy), delimiter="\t")
    csv("plain.csv", None, joints, point, quaternion)
    np.savez_compressed(out / "matrices.npz", q=joints, T_world_tool=poses)
    np.savez(out / "points.npz", joint_angles=np.asfortranarray(joints.astype(">f4").astype(float)), tip_position=point)
    lists = lambda rows: pa.array(rows.tolist(), pa.list_(pa.float64()))
    pq.write_table(pa.table({"joints": lists(joints), "position": lists(point), "orientation_wxyz": lists(quaternion[:, [3, 0, 1, 2]])}),
                   out / "lists.parquet")
    flat = {name: joints[:, k] for k, name in enumerate(names)} | dict(zip(["tip.x", "tip.y", "tip.z"], point.T))
    pq.write_table(pa.table(flat | {"temperature": 20 + 0.01 * np.arange(POSES)}), out / "columns.parquet", compression="zstd")
    # A stream: moves of a second between the poses, a second of rest in each.
    steps = np.linspace(0, 1, 50, endpoint=False)
    ease = steps - np.sin(2 * np.pi * steps) / (2 * np.pi)
    path = np.concatenate([np.vstack([np.repeat(a[None], 50, 0), a + ease[:, None] * (b - a)]) for a, b in zip(joints, joints[1:])])
    seen = np.array([tracker @ tip_of(real, q) @ marker for q in path])[:, :3, 3] + random.normal(0, 2e-5, (len(path), 3))
    csv("stream.csv", ["time_s", *counted, "x", "y", "z"], np.arange(len(path)) / 50, path, seen)
    # A data set of LeRobot.
    lerobot = out / "lerobot"
    (lerobot / "data/chunk-000").mkdir(parents=True, exist_ok=True)
    (lerobot / "meta").mkdir(exist_ok=True)
    single = lambda rows: pa.array(np.asarray(rows, np.float32).tolist(), pa.list_(pa.float32(), rows.shape[1]))
    pq.write_table(
        pa.table({
            "observation.state": single(np.degrees(path)),
            "action": single(np.degrees(np.roll(path, -3, axis=0))),
            "observation.tip_position": pa.array(seen.tolist(), pa.list_(pa.float64(), 3)),
            "timestamp": pa.array(np.arange(len(path)) / 50, pa.float32()),
            "frame_index": np.arange(len(path)),
            "episode_index": np.zeros(len(path), int),
        }),
        lerobot / "data/chunk-000/episode_000000.parquet",
    )
    motors = {"dtype": "float32", "shape": [len(names)], "names": [f"{name}.pos" for name in names]}
    features = {"observation.state": motors, "action": motors,
                "observation.tip_position": {"dtype": "float64", "shape": [3], "names": ["x", "y", "z"]}}
    (lerobot / "meta/info.json").write_text(json.dumps({"codebase_version": "v2.1", "fps": 50, "features": features}))
    print(json.dumps({"poses": POSES}))


main()
