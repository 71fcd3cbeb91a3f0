"""What a session hides: sizes drawn over what is realistic for a low-cost arm, and names that would be right."""
from dataclasses import dataclass, field

import numpy as np


@dataclass
class Hidden:
    """One mechanism. Gaps, springs and frictions are those of the machine; readings are those of its encoders."""

    name: str = "nothing"
    accept: list = field(default_factory=list)  # names that are the truth, as armcal spells them
    size: float = 0.0
    unit: str = ""
    gap_rad: np.ndarray = field(default_factory=lambda: np.zeros(3))
    spring_nm_rad: np.ndarray = field(default_factory=lambda: np.full(3, 6e4))
    link_friction_nm: np.ndarray = field(default_factory=lambda: np.full(3, 0.02))
    motor_friction_nm: np.ndarray = field(default_factory=lambda: np.full(3, 0.4))
    rocking_nm_rad: float | None = None
    beam_nm2: float | None = None  # EI of link 2
    pulley_mismatch: float = 0.0  # share of joint 2 that the belt of joint 3 adds
    skew_rad: float = 0.0  # axis 3 against axis 2
    growth_per_k: float = 0.0
    encoder: callable = lambda joint_rad: joint_rad  # what the discs make of the motors' angles
    slips: list = field(default_factory=list)  # (joint, recording, share of it, rad): a belt jumps teeth
    creep_rad: np.ndarray = field(default_factory=lambda: np.zeros(3))  # of the belts, over the session
    tool_m: dict = field(default_factory=dict)  # recording -> shift of the tip on the flange
    board_m: dict = field(default_factory=dict)  # recording -> shift of the cavities under their markers


def _joint(value, joint):
    rest = np.zeros(3)
    rest[joint - 1] = value
    return rest


def _log(draw, low, high):
    return float(np.exp(draw.uniform(np.log(low), np.log(high))))


def _backlash(joint):
    def make(draw):
        deg = _log(draw, 0.25, 1.0)
        accept = [f"backlash:{joint}", f"gravity_backlash:{joint}"]
        return Hidden(f"backlash{joint}", accept, deg, "deg", gap_rad=_joint(np.radians(deg), joint))

    return make


def _spring(joint, heaviest_nm):
    def make(draw):
        deg = _log(draw, 0.15, 0.8)  # at the heaviest pose
        stiff = np.full(3, 6e4)
        stiff[joint - 1] = heaviest_nm / np.radians(deg)
        accept = [f"{n}:{joint}" for n in ("compliance", "belt_compliance", "hardening_compliance")]
        accept += ["arm_compliance", f"link_bending:{joint}"]
        return Hidden(f"compliance{joint}", accept, deg, "deg", spring_nm_rad=stiff)

    return make


def _windup(draw):
    deg = _log(draw, 0.15, 0.6)
    stiff, link, motor = np.full(3, 6e4), np.full(3, 0.02), np.full(3, 0.4)
    link[0] = motor[0] = 1.5
    stiff[0] = 1.5 / np.radians(deg / 2)
    accept = ["friction_windup:1", "backlash:1"]
    return Hidden("windup1", accept, deg, "deg", spring_nm_rad=stiff, link_friction_nm=link, motor_friction_nm=motor)


def _rocking(draw):
    deg = _log(draw, 0.1, 0.5)
    return Hidden("rocking", ["base_compliance"], deg, "deg", rocking_nm_rad=9.0 / np.radians(deg))


def _bending(draw):
    mm = _log(draw, 0.7, 3.0)
    accept = ["link_bending:2", "link_bending:1", "compliance:2", "compliance:3", "belt_compliance:2", "arm_compliance"]
    # A cantilever of 0.4 m under about 8 N and 4 N m at its end: w = F L^3 / 3 EI + M L^2 / 2 EI.
    return Hidden("bending2", accept, mm, "mm", beam_nm2=(8 * 0.4**3 / 3 + 4 * 0.4**2 / 2) / (mm * 1e-3))


def _eccentric(draw):
    deg, phase = _log(draw, 0.2, 1.0), draw.uniform(0, 2 * np.pi)
    wave = lambda q: q + _joint(np.radians(deg) * np.sin(q[0] + phase), 1)
    accept = ["eccentricity:1", "second_harmonic:1", "gear_ratio:1", "error_curve:1"]
    return Hidden("eccentric1", accept, deg, "deg", encoder=wave)


def _gear(draw):
    percent = _log(draw, 0.3, 2.0) * draw.choice([-1, 1])
    accept = ["gear_ratio:2", "eccentricity:2", "second_harmonic:2", "error_curve:2"]
    return Hidden("gear2", accept, percent, "%", encoder=lambda q: q * (1 + _joint(percent / 100, 2)))


def _coupling(draw):
    percent = _log(draw, 0.5, 3.0) * draw.choice([-1, 1])
    return Hidden("coupling3", ["belt_coupling:3", "belt_coupling:2"], percent, "%", pulley_mismatch=percent / 100)


def _skew(draw):
    deg = _log(draw, 0.2, 1.5) * draw.choice([-1, 1])
    return Hidden("skew3", ["axis_tilt:2", "axis_tilt:3"], deg, "deg", skew_rad=np.radians(deg))


def _slip(draw):
    deg = _log(draw, 0.2, 1.0) * draw.choice([-1, 1])
    slip = (0, int(draw.integers(0, 3)), float(draw.uniform(0.05, 0.95)), np.radians(deg))
    return Hidden("slip1", ["zero_slip:1", "frame_shift"], deg, "deg", slips=[slip])


def _reset(draw):
    deg = _log(draw, 0.2, 1.0) * draw.choice([-1, 1])
    slip = (2, int(draw.integers(1, 3)), 0.0, np.radians(deg))
    return Hidden("slip3", ["zero_slip:3", "tool_shift"], deg, "deg", slips=[slip])


def _direction(draw):
    way = draw.normal(size=3)
    return way / np.linalg.norm(way)


def _tool(draw):
    mm = _log(draw, 0.5, 3.0)
    shift = {int(draw.integers(0, 3)): mm * 1e-3 * _direction(draw)}
    return Hidden("tool", ["tool_shift", "zero_slip:3"], mm, "mm", tool_m=shift)


def _board(draw):
    mm = _log(draw, 0.5, 3.0)
    shift = {int(draw.integers(0, 3)): mm * 1e-3 * _direction(draw)}
    return Hidden("board", ["board_shift"], mm, "mm", board_m=shift)


def _growth(draw):
    ppm = _log(draw, 60, 200)
    return Hidden("growth", ["thermal_growth", "warm_up"], ppm, "ppm/K", growth_per_k=ppm * 1e-6)


def _creep(draw):
    deg = _log(draw, 0.2, 0.8) * draw.choice([-1, 1])
    return Hidden("creep2", ["zero_drift:2"], deg, "deg", creep_rad=_joint(np.radians(deg), 2))


MECHANISMS = {
    "nothing": lambda draw: Hidden(),
    "backlash1": _backlash(1),
    "backlash2": _backlash(2),
    "backlash3": _backlash(3),
    "compliance2": _spring(2, 7.0),
    "compliance3": _spring(3, 2.5),
    "windup1": _windup,
    "rocking": _rocking,
    "bending2": _bending,
    "eccentric1": _eccentric,
    "gear2": _gear,
    "coupling3": _coupling,
    "skew3": _skew,
    "slip1": _slip,
    "slip3": _reset,
    "tool": _tool,
    "board": _board,
    "growth": _growth,
    "creep2": _creep,
}
