"""A session: three tilts of the board led by hand from cavity to cavity, and a few poses that the servo holds."""
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from .machine import Machine

TICK_S = 0.02
TILTS_DEG = [("normal", 0.0, 0.0), ("roll", 11.7, 0.0), ("pitch", 0.0, 11.8)]
PIVOT_M = np.array([0, 0, -0.06])
BOARD_AT_M = np.array([0.42, 0.0, 0.1])
POSES_DEG = np.array([[-60, 60], [-75, 20], [-60, 50]])
HOLD_S, SEATED_S, LIFT_M = 2.2, 1.1, 0.04


@dataclass
class Recording:
    """What the sensors could see of one recording, every TICK_S, in the frame of the floor."""

    name: str
    roll_deg: float
    pitch_deg: float
    start_s: float
    joint_rad: list = field(default_factory=list)
    tip_m: list = field(default_factory=list)
    tip_rotation: list = field(default_factory=list)
    kelvin: list = field(default_factory=list)
    board: np.ndarray | None = None


def cavities():
    """The board: 20 cavities on a circle, 13 on a line."""
    angle = np.arange(20) * 2 * np.pi / 20
    circle = np.stack([0.08 * np.cos(angle), 0.08 * np.sin(angle), 0 * angle], axis=1)
    line = np.stack([np.full(13, 0.11), -0.14375 + 0.025 * np.arange(13), np.zeros(13)], axis=1)
    return np.round(np.vstack([circle, line]), 7)


def tilted(roll_deg, pitch_deg, placed):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("yx", [pitch_deg, roll_deg], degrees=True).as_matrix()
    pose[:3, 3] = PIVOT_M - pose[:3, :3] @ PIVOT_M
    return placed @ pose


class Session:
    """Runs the machine through a day and keeps what there was to see."""

    def __init__(self, rows, hidden, draw):
        self.hidden, self.draw = hidden, draw
        self.machine = Machine(rows, hidden)
        self.made = cavities() + draw.normal(0, 5e-5, (33, 3))
        placed = np.eye(4)
        placed[:3, :3] = Rotation.from_rotvec(draw.normal(0, np.radians(0.4), 3)).as_matrix()
        placed[:3, 3] = BOARD_AT_M + draw.normal(0, 2e-3, 3)
        self.placed = placed

    def run(self):
        return [self._recording(k, *tilt) for k, tilt in enumerate(TILTS_DEG)]

    def _recording(self, index, name, roll_deg, pitch_deg):
        r = Recording(name, roll_deg, pitch_deg, 1200.0 * index)
        self.index, self.kept, self.tick = index, r, 0
        tilt = [v + self.draw.normal(0, 0.1) for v in (roll_deg, pitch_deg)]
        r.board = tilted(*tilt, self.placed)
        order = list(range(33)) + sorted(self.draw.choice(33, 17, replace=False), reverse=True)
        self.expected_ticks = int(len(order) * 2.6 / TICK_S + 12 * 3.2 / TICK_S)
        home = np.radians([0, -30, 10])
        self._drift()
        self.machine.place(home)
        for pose in self._poses(6):
            self._go(pose)
        self._go(home)
        for cavity in order:
            self._seat(r.board, cavity)
        self._take_over()
        for pose in self._poses(6):
            self._go(pose)
        return r

    def _poses(self, count):
        """Poses apart from the board."""
        return np.radians(self.draw.uniform(POSES_DEG[:, 0], POSES_DEG[:, 1], (count, 3)))

    def _drift(self):
        share = min(self.tick / self.expected_ticks, 1.0)
        hours = (self.kept.start_s + self.tick * TICK_S) / 3600
        self.warmer_k = 14 * (1 - np.exp(-hours / 0.35))
        teeth = np.zeros(3)
        for joint, recording, at, size in self.hidden.slips:
            if (self.index, share) >= (recording, at):
                teeth[joint] += size
        day = hours / (1200.0 * len(TILTS_DEG) / 3600)
        self.machine.drift(self.warmer_k, day, teeth, self.hidden.tool_m.get(self.index, np.zeros(3)))

    def _keep(self):
        self.tick += 1
        if self.tick % 25 == 0:
            self._drift()
        r, m = self.kept, self.machine
        r.joint_rad.append(self.hidden.encoder(m.motor_rad))
        r.tip_m.append(m.tip_m)
        r.tip_rotation.append(m.tip_rotation)
        r.kelvin.append(self.warmer_k)

    def _go(self, to_rad):
        start = self.machine.motor_rad
        seconds = max(0.6, 1.9 * np.max(np.abs(to_rad - start)) / 1.0)
        for s in _way(seconds):
            self.machine.drive(start + (to_rad - start) * s, TICK_S)
            self._keep()
        for _ in range(int(HOLD_S / TICK_S)):
            self.machine.drive(to_rad, TICK_S)
            self._keep()

    def _take_over(self):
        self._lead(self.machine.tip_m + [0, 0, 0.08], 0.8, 5e-4)
        hold = self.machine.motor_rad
        for _ in range(10):
            self.machine.drive(hold, TICK_S)
            self._keep()

    def _seat(self, board, cavity):
        shift = self.hidden.board_m.get(self.index, np.zeros(3))
        local = self.made[cavity] + self.draw.normal(0, 8e-5, 3) + shift
        there = board[:3, :3] @ local + board[:3, 3]
        normal = board[:3, 2]
        here = self.machine.tip_m
        above = there + LIFT_M * normal
        lifted = here + max(0.0, LIFT_M - normal @ (here - there)) * normal
        self._lead(lifted, 0.4, 4e-4)
        self._lead(above, max(0.25, 1.9 * np.linalg.norm(above - lifted) / 0.25), 8e-4)
        self._lead(there, 0.45, 3e-4)
        for _ in range(int(SEATED_S / TICK_S)):
            self.machine.lead(there, TICK_S)
            self._keep()

    def _lead(self, to_m, seconds, tremor_m):
        """A smooth movement of the hand that trembles on the way and not at its ends."""
        start, shake = self.machine.tip_m, np.zeros(3)
        for s in _way(seconds):
            shake = 0.7 * shake + 0.7 * self.draw.normal(0, tremor_m, 3)
            self.machine.lead(start + (to_m - start) * s + shake * 4 * s * (1 - s), TICK_S)
            self._keep()


def _way(seconds):
    """From 0 to 1 with the least jerk."""
    s = np.arange(1, int(np.ceil(seconds / TICK_S)) + 1) / np.ceil(seconds / TICK_S)
    return s**3 * (10 - 15 * s + 6 * s * s)
