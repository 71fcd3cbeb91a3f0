"""Solves an exported armcal problem with scipy, by kinematics of its own, and compares the optimum.

usage: solve_problem.py problem.json -> one JSON line {"cost_scipy", "cost_armcal", "worst_sigmas", "worst"}
"""
import json
import sys
import tomllib

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

problem = json.load(open(sys.argv[1]))
rows = tomllib.loads(problem["model"])["rows"]
observations = [o for o in problem["observations"] if o["in_fit"]]
parameters = problem["parameters"]
names = [p["name"] for p in parameters]
nominal = np.array([p["nominal"] for p in parameters])
free = np.array([p["free"] for p in parameters])
sigma = np.array([p["prior_sigma"] or np.inf for p in parameters])
lower = np.array([-np.inf if p["lower"] is None else p["lower"] for p in parameters])
upper = np.array([np.inf if p["upper"] is None else p["upper"] for p in parameters])
whiteners = [np.linalg.inv(np.linalg.cholesky(np.array(o["covariance_m2"]))) for o in observations]


def frame(at, name, p):
    """A frame at its nominal pose, moved by its parameters x, y, z (absolute) and rx, ry, rz (own axes)."""
    pose = np.array(at)
    for axis in range(3):
        key = f"{name}.{'xyz'[axis]}"
        if key in names:
            pose[axis, 3] = p[names.index(key)]
    turn = [p[names.index(f"{name}.r{a}")] if f"{name}.r{a}" in names else 0.0 for a in "xyz"]
    pose[:3, :3] = pose[:3, :3] @ Rotation.from_rotvec(turn).as_matrix()
    return pose


def rotation_and_shift(axis, angle, shift):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler(axis, angle).as_matrix()
    pose["xyz".index(axis), 3] = shift
    return pose


def forward(p, joints):
    pose, joint = np.eye(4), 0
    for row in rows:
        value = {
            q: p[names.index(f"{row['name']}.{q}")] if f"{row['name']}.{q}" in names else 0.0
            for q in ("theta", "d", "a", "alpha", "beta")
        }
        if row.get("joint", "revolute") == "revolute":
            value["theta"] += joints[joint]
            joint += 1
        pose = pose @ rotation_and_shift("z", value["theta"], value["d"])
        pose = pose @ rotation_and_shift("x", value["alpha"], value["a"])
        pose = pose @ rotation_and_shift("y", value["beta"], 0.0)
    return pose


def residuals(x):
    p = nominal.copy()
    p[free] = x
    base = frame(problem["frames"]["world_from_base"], "base", p)
    tip = frame(problem["frames"]["last_link_from_tip"], "tip", p)
    out = []
    for o, white in zip(observations, whiteners):
        predicted = (base @ forward(p, o["joint_rad"]) @ tip)[:3, 3]
        if "cavity" in o["reference"]:
            board = frame(problem["frames"]["world_from_board"][o["recording"]], problem["board_names"][o["recording"]], p)
            measured = (board @ np.append(o["reference"]["in_board_m"], 1.0))[:3]
        else:
            measured = np.array(o["reference"]["position_m"])
        out.append(white @ (measured - predicted))
    prior = ((p - nominal) / sigma)[free]
    return np.concatenate([np.concatenate(out), prior[np.isfinite(sigma[free])]])


start = np.clip(nominal, lower, upper)[free]
scale = np.where(np.isfinite(sigma), sigma, 0.1)[free]
solved = least_squares(
    residuals, start, bounds=(lower[free], upper[free]), x_scale=scale, xtol=1e-14, ftol=1e-14, gtol=1e-12
)
ours = np.array([p["value"] for p in parameters])[free]
spread = np.sqrt(np.diag(np.linalg.pinv(solved.jac.T @ solved.jac)))
off = np.abs(solved.x - ours) / spread
worst = int(np.argmax(off))
print(
    json.dumps(
        {
            "cost_scipy": solved.cost,
            "cost_armcal": 0.5 * float(np.sum(residuals(ours) ** 2)),
            "worst_sigmas": float(off[worst]),
            "worst": [n for n, f in zip(names, free) if f][worst],
            "free": int(free.sum()),
        }
    )
)
