"""The fit problem of the bench by scipy: fit_scipy.py PROBLEM.json -> one JSON line.

Kinematics of its own, all dwells at once in numpy; the Jacobian by finite differences and by the geometric formula
(an angle turns the tip about its axis, a length shifts it along its axis). x is in units of the prior.
"""
import json
import statistics
import sys
import time

import numpy as np
from scipy.optimize import least_squares

problem = json.load(open(sys.argv[1]))
parameters = problem["parameters"]
at = {p["name"]: k for k, p in enumerate(parameters)}
free = np.array([k for k, p in enumerate(parameters) if p["free"]])
nominal = np.array([p["nominal"] for p in parameters])
scale = np.array([p["prior_sigma"] if p["free"] else 1.0 for p in parameters])[free]
# JSON has no infinity: no bound is null.
lower = np.array([-np.inf if p["lower"] is None else p["lower"] for p in parameters])[free]
upper = np.array([np.inf if p["upper"] is None else p["upper"] for p in parameters])[free]
bounds = (lower - nominal[free]) / scale, (upper - nominal[free]) / scale
joint_rad = np.array([o["joint_rad"] for o in problem["observations"]])
measured_m = np.array([o["measured_m"] for o in problem["observations"]])
whitener = np.array([o["whitener"] for o in problem["observations"]])
base_rotation = np.array(problem["base_rotation"])
huber_c, sigma_scale = problem["huber_c"], problem["sigma_scale"]


def exp(r):
    """Rotation of a rotation vector, and its right Jacobian."""
    angle = np.linalg.norm(r)
    k = np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])
    if angle < 1e-8:
        return np.eye(3) + k + 0.5 * k @ k, np.eye(3) - 0.5 * k
    sine, cosine = np.sin(angle), np.cos(angle)
    rotation = np.eye(3) + sine / angle * k + (1 - cosine) / angle**2 * k @ k
    return rotation, np.eye(3) - (1 - cosine) / angle**2 * k + (angle - sine) / angle**3 * k @ k


def tip(p, with_jacobian):
    """Tips in the world [m], and their derivatives by the parameters that move them, by name."""
    n = len(joint_rad)
    x, y, z = (np.tile(axis, (n, 1)) for axis in np.eye(3))
    origin, moves = np.zeros((n, 3)), []
    for row in problem["rows"]:
        theta, d, a, alpha = (p[at[f"{row['name']}.{q}"]] for q in ("theta", "d", "a", "alpha"))
        angle = theta + (0.0 if row["joint"] is None else joint_rad[:, row["joint"]])
        moves.append((f"{row['name']}.theta", True, z, origin))
        cosine, sine = np.cos(angle).reshape(-1, 1), np.sin(angle).reshape(-1, 1)
        x, y = cosine * x + sine * y, cosine * y - sine * x
        moves += [(f"{row['name']}.d", False, z, None), (f"{row['name']}.a", False, x, None)]
        origin = origin + d * z + a * x
        moves.append((f"{row['name']}.alpha", True, x, origin))
        cosine, sine = np.cos(alpha), np.sin(alpha)
        y, z = cosine * y + sine * z, cosine * z - sine * y
    offset = [p[at[f"tip.{q}"]] for q in "xyz"]
    moves += [(f"tip.{q}", False, axis, None) for q, axis in zip("xyz", (x, y, z))]
    in_base = origin + offset[0] * x + offset[1] * y + offset[2] * z
    turn, right = exp(np.array([p[at[f"base.r{q}"]] for q in "xyz"]))
    rotation = base_rotation @ turn
    in_world = in_base @ rotation.T + [p[at[f"base.{q}"]] for q in "xyz"]
    if not with_jacobian:
        return in_world, None
    jacobian = np.zeros((n, 3, len(parameters)))
    for name, turns, axis, through in moves:
        column = np.cross(axis, in_base - through) if turns else axis
        jacobian[:, :, at[name]] = column @ rotation.T
    for k, q in enumerate("xyz"):
        jacobian[:, k, at[f"base.{q}"]] = 1.0
        jacobian[:, :, at[f"base.r{q}"]] = np.cross(right[:, k], in_base) @ rotation.T
    return in_world, jacobian


def stretch(u):
    """sqrt(2 rho(u)) / u of Huber's loss, and the derivative of sqrt(2 rho(u))."""
    outside = (u > huber_c) if huber_c else np.zeros(len(u), dtype=bool)
    root = np.sqrt(2 * huber_c * u[outside] - huber_c**2) if huber_c else u[outside]
    across, along = np.ones(len(u)), np.ones(len(u))
    across[outside], along[outside] = root / u[outside], (huber_c or 1.0) / root
    return across, along


def at_x(x):
    p = nominal.copy()
    p[free] += scale * x
    return p


def residual(x):
    e = np.einsum("nij,nj->ni", whitener, measured_m - tip(at_x(x), False)[0]) / sigma_scale
    across, _ = stretch(np.linalg.norm(e, axis=1))
    return np.concatenate([(across[:, None] * e).ravel(), x])


def jacobian(x):
    in_world, derivative = tip(at_x(x), True)
    e = np.einsum("nij,nj->ni", whitener, measured_m - in_world) / sigma_scale
    rows = -(whitener @ (derivative[:, :, free] * scale)) / sigma_scale
    u = np.linalg.norm(e, axis=1)
    across, along = stretch(u)
    unit = e / u[:, None]
    radial = np.einsum("ni,nik->nk", unit, rows)
    rows = across[:, None, None] * rows + (along - across)[:, None, None] * unit[:, :, None] * radial[:, None, :]
    return np.concatenate([rows.reshape(-1, len(free)), np.eye(len(free))])


def timed(jac, method):
    def once():
        start = np.zeros(len(free))
        return least_squares(residual, start, jac, bounds, method)  # tolerances 1e-8: scipy's own

    solved, wall_s, cpu_s, began = once(), [], [], time.perf_counter()
    while len(wall_s) < 5 or (len(wall_s) < 100 and time.perf_counter() - began < 3.0):
        wall, cpu = time.perf_counter(), time.process_time()
        solved = once()
        wall_s.append(time.perf_counter() - wall)
        cpu_s.append(time.process_time() - cpu)
    return {
        "how": f"{method}, {'analytic' if callable(jac) else jac} Jacobian",
        "wall_s": statistics.median(wall_s),
        "cpu_s": statistics.median(cpu_s),
        "same_cost": 1e-9 if callable(jac) else 1e-8,  # differences of 2 points see no finer
        "evaluations": int(solved.nfev),
        "values": at_x(solved.x).tolist(),
    }


print(json.dumps([timed("2-point", "trf"), timed(jacobian, "trf"), timed(jacobian, "dogbox")]))
