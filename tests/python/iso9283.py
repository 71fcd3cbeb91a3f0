"""Criteria of ISO 9283 from the JSON of an armcal_iso9283::Evidence, by an implementation of its own.

usage: iso9283.py evidence.json limit_band_m planes -> one JSON object {"clause symbol place": value in SI units}
"""
import json
import sys
from itertools import combinations

import numpy as np

evidence = json.load(open(sys.argv[1]))
band = float(sys.argv[2])
planes = int(sys.argv[3])
out = {}


def position(pose):
    return np.array(pose["position_m"])


def matrix(pose):
    """Rotation matrix of a quaternion [i, j, k, w]."""
    i, j, k, w = pose["orientation"]
    v = np.array([i, j, k])
    cross = np.array([[0, -k, j], [k, 0, -i], [-j, i, 0]])
    return np.eye(3) * (w * w - v @ v) + 2 * np.outer(v, v) + 2 * w * cross


def rotvec(r):
    """Rotation vector of a matrix, for turns below half a turn."""
    axis = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]) / 2
    s = np.linalg.norm(axis)
    angle = np.arctan2(s, (np.trace(r) - 1) / 2)
    return axis if s < 1e-12 else axis / s * angle


def mean_matrix(rs):
    """Chordal mean: the rotation closest to the mean matrix."""
    u, _, vt = np.linalg.svd(np.mean(rs, axis=0))
    return u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt


def put(clause, symbol, place, parts, values):
    for part, value in zip(parts, np.atleast_1d(values)):
        out[f"{clause} {symbol}{part} {place}"] = float(value)


XYZ, ABC = ["_x", "_y", "_z"], ["_a", "_b", "_c"]


def accuracy(commanded, poses):
    d = np.mean([position(p) for p in poses], axis=0) - position(commanded)
    return d, rotvec(mean_matrix([matrix(p) for p in poses]) @ matrix(commanded).T)


def repeatability(poses):
    x = np.array([position(p) for p in poses])
    l = np.linalg.norm(x - x.mean(axis=0), axis=1)
    centre = mean_matrix([matrix(p) for p in poses])
    turns = np.array([rotvec(matrix(p) @ centre.T) for p in poses])
    return l.mean() + 3 * l.std(ddof=1), 3 * turns.std(axis=0, ddof=1)


settled_before = {}


def settle(visit):
    """Brute force: the approach resampled so finely that no crossing is missed, each then refined by bisection."""
    if visit["time_ns"] in settled_before:
        return settled_before[visit["time_ns"]]
    t = np.array([s["time_ns"] for s in visit["arrival"]]) * 1e-9
    x = np.array([position(s["pose"]) for s in visit["arrival"]]) - position(visit["attained"])

    def inside(at):
        return np.linalg.norm([np.interp(at, t, x[:, k]) for k in range(3)], axis=0) <= band

    fine = np.linspace(t[0], t[-1], 20 * len(t))
    state = inside(fine)
    edges = []
    for k in np.flatnonzero(~state[:-1] & state[1:]):
        low, high = fine[k], fine[k + 1]
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (low, middle) if inside(middle) else (middle, high)
        edges.append(high)
    away = np.linalg.norm(x, axis=1)[t >= edges[0]].max()
    settled_before[visit["time_ns"]] = edges[0], edges[-1], away if away > band else 0.0
    return settled_before[visit["time_ns"]]


# Poses: by name, then by direction (the evidence has the three axes).
visits = sorted(evidence["visits"], key=lambda v: v["time_ns"])
groups = {}
for v in visits:
    groups.setdefault((v["pose"], tuple(v["approach"])), []).append(v)
for (pose, direction), vs in groups.items():
    place = "{} ({:+.2f}, {:+.2f}, {:+.2f})".format(pose, *direction)
    poses, commanded = [v["attained"] for v in vs], vs[0]["commanded"]
    d, turn = accuracy(commanded, poses)
    put("7.2.1", "AP", place, ["_P"], np.linalg.norm(d))
    put("7.2.1", "AP", place, XYZ + ABC, [*d, *turn])
    rp, rp_turn = repeatability(poses)
    put("7.2.2", "RP", place, ["_l"] + ABC, [rp, *rp_turn])
    settled = [settle(v) for v in vs]
    put("7.4", "t", place, [""], np.mean([s[1] - s[0] for s in settled]))
    put("7.5", "OV", place, [""], max(s[2] for s in settled))
    size = min(10, len(poses) // 2)
    blocks = [poses[k:k + size] for k in range(0, len(poses) - size + 1, size)]
    aps = [accuracy(commanded, b) for b in blocks]
    aps = np.array([[np.linalg.norm(d), *turn] for d, turn in aps])
    rps = np.array([[rp, *turn] for rp, turn in map(repeatability, blocks)])
    put("7.6", "dAP", place, ["_P"] + ABC, np.abs(aps[1:] - aps[0]).max(axis=0))
    put("7.6", "dRP", place, ["_P"] + ABC, np.abs(rps[1:] - rps[0]).max(axis=0))
for pose in sorted({v["pose"] for v in visits}):
    clusters = [[v["attained"] for v in vs] for (name, _), vs in groups.items() if name == pose]
    pairs = list(combinations(clusters, 2))
    centre = lambda c: np.mean([position(p) for p in c], axis=0)
    put("7.2.3", "vAP", pose, ["_P"], max(np.linalg.norm(centre(a) - centre(b)) for a, b in pairs))
    frame = lambda c: mean_matrix([matrix(p) for p in c])
    put("7.2.3", "vAP", pose, ABC, np.max([np.abs(rotvec(frame(a) @ frame(b).T)) for a, b in pairs], axis=0))

# Moves.
moves = {}
for a, b in zip(visits, visits[1:]):
    moves.setdefault((a["pose"], b["pose"]), []).append((a, b))
for (a, b), pairs in moves.items():
    def distance(p, q):
        step = position(q) - position(p)
        return np.array([np.linalg.norm(step), *np.abs(step), *np.abs(rotvec(matrix(q) @ matrix(p).T))])
    asked = distance(pairs[0][0]["commanded"], pairs[0][1]["commanded"])
    got = np.array([distance(p["attained"], q["attained"]) for p, q in pairs])
    parts = ["_P"] + XYZ + ABC
    put("7.3.2", "AD", f"{a} to {b}", parts, got.mean(axis=0) - asked)
    put("7.3.3", "RD", f"{a} to {b}", parts, 3 * got.std(axis=0, ddof=1))
    put("9", "", f"{a} to {b}", [""], np.mean([settle(q)[1] - q["departed_ns"] * 1e-9 for _, q in pairs]))

# Paths: each plane is crossed where a run, followed from the last plane on, first comes to its front.
for path in evidence["paths"]:
    name = path["name"]
    points = np.array([position(p) for p in path["commanded"]])
    legs = np.linalg.norm(np.diff(points, axis=0), axis=1)
    ends = np.concatenate([[0], np.cumsum(legs)])
    hits = []
    for run in path["runs"]:
        t = np.array([s["time_ns"] for s in run]) * 1e-9
        x = np.array([position(s["pose"]) for s in run])
        start, row = 0, []
        for s in (np.arange(planes) + 0.5) / planes * ends[-1]:
            leg = np.searchsorted(ends, s) - 1
            normal = (points[leg + 1] - points[leg]) / legs[leg]
            foot = points[leg] + normal * (s - ends[leg])
            d = (x - foot) @ normal
            near = np.linalg.norm(x - foot, axis=1) < 0.05
            k = next((k for k in range(start, len(d) - 1) if d[k] < 0 <= d[k + 1] and near[k]), None)
            if k is None:
                row.append(None)
                continue
            f = d[k] / (d[k] - d[k + 1])
            half = rotvec(matrix(run[k + 1]["pose"]) @ matrix(run[k]["pose"]).T) * f
            angle = np.linalg.norm(half)
            u = half / angle if angle else np.zeros(3)
            skew = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
            turn = np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew
            row.append((foot, x[k] + f * (x[k + 1] - x[k]), t[k] + f * (t[k + 1] - t[k]), turn @ matrix(run[k]["pose"])))
            start = k
        hits.append(row)
    frame = matrix(path["commanded"][0])
    at, at_turn, rt, rt_turn = [], [], [], []
    for column in zip(*hits):
        if any(h is None for h in column):
            continue
        x = np.array([h[1] for h in column])
        at.append(np.linalg.norm(x.mean(axis=0) - column[0][0]))
        l = np.linalg.norm(x - x.mean(axis=0), axis=1)
        rt.append(l.mean() + 3 * l.std(ddof=1))
        centre = mean_matrix([h[3] for h in column])
        at_turn.append(np.abs(rotvec(centre @ frame.T)))
        rt_turn.append(3 * np.std([rotvec(h[3] @ centre.T) for h in column], axis=0, ddof=1))
    put("8.2", "AT", name, ["_P"] + ABC, [max(at), *np.max(at_turn, axis=0)])
    put("8.3", "RT", name, ["_P"] + ABC, [max(rt), *np.max(rt_turn, axis=0)])
    speeds = []
    for row in hits:
        pairs = [(a, b) for a, b in zip(row[planes // 4:planes - planes // 4], row[planes // 4 + 1:planes - planes // 4]) if a and b]
        speeds.append([np.linalg.norm(b[1] - a[1]) / (b[2] - a[2]) for a, b in pairs])
    means = np.array([np.mean(v) for v in speeds])
    put("8.6", "AV", name, [""], means.mean() / path["speed_m_s"] - 1)
    put("8.6", "RV", name, [""], 3 * means.std(ddof=1) / path["speed_m_s"])
    put("8.6", "FV", name, [""], max(max(v) - min(v) for v in speeds))
    for c in range(1, len(points) - 1):
        into, out_of = (points[c] - points[c - 1]) / legs[c - 1], (points[c + 1] - points[c]) / legs[c]
        side = into - out_of * (into @ out_of)
        cuts, overs = [], []
        for run in path["runs"]:
            x = np.array([position(s["pose"]) for s in run])
            fine = np.concatenate([np.linspace(a, b, 400, endpoint=False) for a, b in zip(x, x[1:])])
            away = np.linalg.norm(fine - points[c], axis=1)
            cuts.append(away.min())
            after = x[away.argmin() // 400 + 1:] - points[c]
            past = np.flatnonzero(after @ out_of > legs[c])
            after = after[:past[0]] if len(past) else after
            after = after[after @ side > 0]
            overs.append(np.linalg.norm(after - np.outer(after @ out_of, out_of), axis=1).max(initial=0))
        put("8.5", "CR", f"{name} corner {c}", [""], np.mean(cuts))
        put("8.5", "CO", f"{name} corner {c}", [""], np.mean(overs))

print(json.dumps(out))
