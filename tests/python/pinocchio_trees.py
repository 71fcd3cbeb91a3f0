"""What pinocchio makes of trees of links: places, motions and gravity torques.

usage: pinocchio_trees.py CASES.json

CASES.json holds a list of {urdf, links, readings, following, resting}: the robot, the links that are asked for, what each
joint with an encoder reads, `[joint, leader, ratio, offset]` of joints that follow another, and where all others stand.
Prints for each {places, motions, torques}: 3x4 rows of each link, 6 rows a link with one column a reading (in the order they
were given, axes of the world, at the link), and gravity's generalised force on each reading. Joints that follow are expanded
by hand: a reading's column is the sum of its joints' columns, each by its ratio.
"""

import json
import sys

import numpy as np
import pinocchio as pin


def placed(model, angles):
    """The configuration vector: continuous joints are a cosine and a sine there."""
    q = pin.neutral(model)
    for name, angle in angles.items():
        joint = model.joints[model.getJointId(name)]
        if joint.nq == 2:
            q[joint.idx_q], q[joint.idx_q + 1] = np.cos(angle), np.sin(angle)
        else:
            q[joint.idx_q] = angle
    return q


def answer(case):
    model = pin.buildModelFromXML(case["urdf"])
    model.gravity.linear = np.array([0.0, 0.0, -9.80665])
    data = model.createData()
    readings = dict(case["readings"])
    order = [name for name, _ in case["readings"]]
    angles = {**readings, **dict(case["resting"])}
    columns = {name: [(name, 1.0)] for name in order}
    for name, leader, ratio, offset in case["following"]:
        angles[name] = ratio * readings[leader] + offset
        columns[leader].append((name, ratio))
    q = placed(model, angles)
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    torque = -pin.computeGeneralizedGravity(model, data, q)
    at = {name: model.joints[model.getJointId(name)].idx_v for names in columns.values() for name, _ in names}
    places, motions = [], []
    for link in case["links"]:
        frame = model.getFrameId(link)
        pose = data.oMf[frame]
        places.append(np.hstack([pose.rotation, pose.translation[:, None]]).tolist())
        # A tree with one frame asked for needs its own Jacobian; the axes are the world's.
        jacobian = pin.getFrameJacobian(model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        own = [sum(ratio * jacobian[:, at[name]] for name, ratio in columns[reading]) for reading in order]
        motions.append(np.array(own).T.tolist())
    torques = [sum(ratio * torque[at[name]] for name, ratio in columns[reading]) for reading in order]
    return {"places": places, "motions": motions, "torques": torques}


with open(sys.argv[1]) as file:
    json.dump([answer(case) for case in json.load(file)], sys.stdout)
