"""What public parsers make of files that `armcal write` wrote: where each place is at given joint readings.

Usage: written_formats.py CASES.json. A case is {"reader", "path", "root", "joints": [names], "places": [names], "readings":
[[..]]}; the answer is, by case, [[[4x4], one a place], one a vector of readings]. Readers share no code with armcal: pinocchio
(URDF, MJCF), mujoco (MJCF), Drake (URDF, SDF), the xacro package; PyYAML and the formula of ur_description for a UR, elementary
matrices for rows of a DH table, which have no parser of their own.
"""

import csv
import json
import sys
import tempfile
from pathlib import Path

import numpy as np


def about(axis, angle):
    """4x4 rotation about x, y or z."""
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.eye(4)
    j, k = [(1, 2), (2, 0), (0, 1)]["xyz".index(axis)]
    matrix[j, j] = matrix[k, k] = c
    matrix[j, k], matrix[k, j] = -s, s
    return matrix


def shifted(x, y, z):
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def by_pinocchio(case, path):
    import pinocchio

    read = pinocchio.buildModelFromUrdf if str(path).endswith(".urdf") else pinocchio.buildModelFromMJCF
    model = read(str(path))
    data = model.createData()
    for readings in case["readings"]:
        q = pinocchio.neutral(model)
        for name, value in zip(case["joints"], readings):
            joint = model.joints[model.getJointId(name)]
            # A joint without limits is a point of the unit circle there.
            q[joint.idx_q : joint.idx_q + joint.nq] = [value] if joint.nq == 1 else [np.cos(value), np.sin(value)]
        pinocchio.framesForwardKinematics(model, data, q)
        kinds = pinocchio.FrameType.BODY, pinocchio.FrameType.OP_FRAME
        at = {f.name: data.oMf[i].homogeneous for i, f in enumerate(model.frames) if f.type in kinds}
        root = np.linalg.inv(at.get(case["root"], np.eye(4)))
        yield [(root @ at[name]).tolist() for name in case["places"]]


def by_mujoco(case, path):
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for readings in case["readings"]:
        for name, value in zip(case["joints"], readings):
            data.qpos[model.joint(name).qposadr[0]] = value
        mujoco.mj_kinematics(model, data)
        answer = []
        for name in case["places"]:
            matrix = np.eye(4)
            matrix[:3, :3], matrix[:3, 3] = data.site(name).xmat.reshape(3, 3), data.site(name).xpos
            answer.append(matrix.tolist())
        yield answer


def by_drake(case, path):
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(path))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    root = plant.GetFrameByName(case["root"])
    for readings in case["readings"]:
        for name, value in zip(case["joints"], readings):
            joint = plant.GetJointByName(name)
            if hasattr(joint, "set_angle"):
                joint.set_angle(context, value)
            else:
                joint.set_translation(context, value)
        places = [plant.GetFrameByName(name).CalcPose(context, root) for name in case["places"]]
        yield [pose.GetAsMatrix4().tolist() for pose in places]


def by_xacro(case, path):
    """The file included by a description with the origins of the case; read as URDF then."""
    import xacro

    with tempfile.TemporaryDirectory() as folder:
        description = Path(folder) / "robot.urdf.xacro"
        description.write_text(case["description"].replace("@PATCH@", str(path)))
        urdf = Path(folder) / "robot.urdf"
        urdf.write_text(xacro.process_file(str(description)).toprettyxml())
        yield from by_pinocchio(case, urdf)


UR = ["shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"]


def by_ur(case, path):
    """ur_macro.xacro of ur_description: joint i at xyz, rpy in the link before it, about its z."""
    import yaml

    kinematics = yaml.safe_load(Path(path).read_text())["kinematics"]
    assert list(kinematics) == UR + ["hash"] and kinematics["hash"] == case["hash"], kinematics
    for readings in case["readings"]:
        at = np.eye(4)
        for name, q in zip(UR, readings):
            o = kinematics[name]
            assert all(isinstance(o[k], float) for k in o) and len(o) == 6, o
            turn = about("z", o["yaw"]) @ about("y", o["pitch"]) @ about("x", o["roll"])
            at = at @ shifted(o["x"], o["y"], o["z"]) @ turn @ about("z", q)
        yield [at.tolist()]


def by_ur_description(case, path):
    """The whole of ur_description (`folder`, a clone), expanded by xacro with the file as its kinematics."""
    import xacro
    from xacro import substitution_args

    substitution_args._eval_find = lambda package: case["folder"]
    arguments = {"name": "ur", "ur_type": "ur10", "kinematics_params": str(path)}
    document = xacro.process_file(case["folder"] + "/urdf/ur.urdf.xacro", mappings=arguments)
    with tempfile.TemporaryDirectory() as folder:
        urdf = Path(folder) / "ur.urdf"
        urdf.write_text(document.toprettyxml())
        yield from by_pinocchio(case, urdf)


def by_rows(case, path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    for readings in case["readings"]:
        left = dict(zip(case["joints"], readings))
        at = np.eye(4)
        for row in rows:
            theta, alpha = np.deg2rad(float(row["theta_deg"])), np.deg2rad(float(row["alpha_deg"]))
            d, a = float(row["d_mm"]) * 1e-3, float(row["a_mm"]) * 1e-3
            if row["type"] == "revolute":
                theta += left.pop(row["joint"])
            elif row["type"] == "prismatic":
                d += left.pop(row["joint"])
            own, link = about("z", theta) @ shifted(0, 0, d), shifted(a, 0, 0) @ about("x", alpha)
            at = at @ (own @ link if row["convention"] == "standard" else link @ own)
        assert not left, left
        yield [at.tolist()]


def by_offsets(case, path):
    """Offsets of the joints, in their order."""
    import yaml

    offsets = yaml.safe_load(Path(path).read_text())["joint_offsets"]
    yield [offsets[name] for name in case["joints"]]


READERS = {f.__name__.removeprefix("by_"): f for f in [
    by_pinocchio, by_mujoco, by_drake, by_xacro, by_ur, by_ur_description, by_rows, by_offsets]}

if __name__ == "__main__":
    cases = json.loads(Path(sys.argv[1]).read_text())
    json.dump([list(READERS[case["reader"]](case, case["path"])) for case in cases], sys.stdout)
