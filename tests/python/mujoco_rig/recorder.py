"""What a lab would have of a session: ROS 2 recordings, a board, a DH table as declared, a pipeline. No truth."""
import os

import numpy as np
from mcap_ros2.writer import Writer
from scipy.spatial.transform import Rotation

from .machine import NOMINAL
from .session import TICK_S, cavities

HEADER = """std_msgs/Header header
{fields}
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec"""
JOINT_STATE = HEADER.format(fields="string[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort")
TEMPERATURE = HEADER.format(fields="float64 temperature\nfloat64 variance")
POSE = HEADER.format(fields="geometry_msgs/Pose pose") + """
================================================================================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w"""
START_S = 1_780_000_000
COUNTS_PER_TURN = 2**15
CAMERA_M, WANDER_M = 1.4e-4, 6e-5


def write(folder, recordings, draw):
    """Writes the session as a lab would have it."""
    os.makedirs(folder, exist_ok=True)
    world = np.eye(4)
    world[:3, :3] = Rotation.from_euler("zyx", [30, -0.6, 0.4], degrees=True).as_matrix()
    world[:3, 3] = [1.2, -0.4, 0.75]
    for r in recordings:
        _recording(os.path.join(folder, f"{r.name}.mcap"), r, world, draw)
    for name, text in {"board.toml": _board(), "arm.toml": _arm(), "pipeline.toml": _pipeline(recordings)}.items():
        with open(os.path.join(folder, name), "w") as out:
            out.write(text)


def _header(at_s, frame):
    whole = int(np.floor(at_s))
    return {"stamp": {"sec": whole, "nanosec": int((at_s - whole) * 1e9)}, "frame_id": frame}


def _pose(at_s, place, rotation):
    x, y, z, w = Rotation.from_matrix(rotation).as_quat()
    return {
        "header": _header(at_s, "vicon/world"),
        "pose": {
            "position": dict(zip("xyz", map(float, place))),
            "orientation": {"x": float(x), "y": float(y), "z": float(z), "w": float(w)},
        },
    }


def _recording(path, r, world, draw):
    with open(path, "wb") as stream:
        writer = Writer(stream)
        joint = writer.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
        pose = writer.register_msgdef("geometry_msgs/msg/PoseStamped", POSE)
        heat = writer.register_msgdef("sensor_msgs/msg/Temperature", TEMPERATURE)
        wander = np.zeros(3)
        keep = np.exp(-TICK_S / 2.0)
        turn = lambda deg: Rotation.from_rotvec(draw.normal(0, np.radians(deg), 3)).as_matrix()
        count = 2 * np.pi / COUNTS_PER_TURN
        for k, joints in enumerate(r.joint_rad):
            at = START_S + r.start_s + k * TICK_S
            log = int((at + 0.004) * 1e9)
            send = lambda topic, schema, message, late=0: writer.write_message(topic, schema, message, log + late, log + late)
            send("/joint_states", joint, {
                "header": _header(at, ""), "name": ["joint1", "joint2", "joint3"],
                "position": [float(v) for v in np.round(joints / count) * count], "velocity": [], "effort": [],
            })
            wander = wander * keep + draw.normal(0, WANDER_M, 3) * np.sqrt(1 - keep**2)
            seen = world[:3, :3] @ r.tip_m[k] + world[:3, 3] + draw.normal(0, CAMERA_M, 3) + wander
            send("/vicon/tip/tip", pose, _pose(at, seen, world[:3, :3] @ r.tip_rotation[k] @ turn(0.1)), 1000)
            if k % 10 == 0:
                noise = lambda: draw.normal(0, CAMERA_M, 3)
                send("/vicon/base/base", pose, _pose(at, world[:3, 3] + noise(), world[:3, :3] @ turn(0.05)), 2000)
                board = world @ r.board
                send("/vicon/table/table", pose, _pose(at, board[:3, 3] + noise(), board[:3, :3] @ turn(0.05)), 3000)
            if k % 50 == 0:
                kelvin = 22 + r.kelvin[k] + draw.normal(0, 0.1)
                send("/temperature", heat, {"header": _header(at, "arm"), "temperature": float(kelvin), "variance": 0.0})
        writer.finish()


def _board():
    text = 'name = "paper"\ncavity_sigma_mm = 0.05\nseat_sigma_mm = 0.1\n[mechanism]\npivot_xyz_mm = [0.0, 0.0, -60.0]\n'
    text += "roll_axis = [1.0, 0.0, 0.0]\npitch_axis = [0.0, 1.0, 0.0]\nmax_roll_deg = 20.0\nmax_pitch_deg = 45.0\n"
    for k, at in enumerate(cavities() * 1e3):
        text += f'[[cavities]]\nname = "c{k + 1:02}"\nxyz_mm = [{", ".join(f"{v:.4f}" for v in at)}]\n'
    return text


def _arm():
    text = 'name = "arm"\nconvention = "standard"\n[deviation]\nbound_mm = 5.0\nbound_deg = 2.0\n'
    text += "prior_sigma_mm = 4.0\nprior_sigma_deg = 1.6\n"
    for k, (theta, d, a, alpha) in enumerate(NOMINAL):
        name, kind = ("tool", 'joint = "fixed"\n') if k == 3 else (f"joint{k + 1}", "")
        text += f'[[rows]]\nname = "{name}"\n{kind}theta_deg = {theta}\nd_mm = {d * 1e3}\na_mm = {a * 1e3}\nalpha_deg = {alpha}\n'
    return text


def _pipeline(recordings):
    text = 'name = "rig"\n'
    for r in recordings:
        text += f'[[recordings]]\npaths = ["{r.name}.mcap"]\n'
        text += f"tilt = {{ roll_deg = {r.roll_deg}, pitch_deg = {r.pitch_deg} }}\n"
    text += '[streams.joints]\ntopic = "/joint_states"\nnames = ["joint1", "joint2", "joint3"]\n'
    for body in ("tip", "base", "table"):
        text += f'[streams.{body}]\ntopic = "/vicon/{body}/{body}"\n'
    text += '[streams.temperature]\ntopic = "/temperature"\n[table]\nboard = "board.toml"\npose = "measured"\n'
    text += '[model]\ndh = "arm.toml"\n[frames.base]\npose = "measured"\nsigma_mm = 0.3\nsigma_deg = 0.05\n'
    return text + '[holdout]\nkind = "cavity-folds"\nk = 5\n'
