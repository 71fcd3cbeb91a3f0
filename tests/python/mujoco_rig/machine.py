"""The arm as a MuJoCo model: links in gravity, motors behind gears with gap and spring, a hand that may hold the tip."""
import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

# theta, d, a, alpha [m, deg] of the paper's right arm, as declared; the machine differs from it.
NOMINAL = np.array([[0, 0.076, 0, 90], [90, 0, 0.4, 0], [0, -0.012, 0, 90], [0, 0.3543, 0, 90]])
LINK_KG = [1.5, 1.2, 0.6]
TIP_KG = 0.15
KP_NM_RAD = [1500.0, 2500.0, 800.0]
STEP_S = 1e-3
BEAM_PARTS = 4


def as_built(draw):
    """The declared rows with what a workshop leaves: up to 3 mm and 1 deg."""
    size = np.array([1.0, 3e-3, 3e-3, 1.0])
    rows = NOMINAL + draw.uniform(-1, 1, NOMINAL.shape) * size
    rows[0, 0] = NOMINAL[0, 0]  # no one can tell these from the base's place
    rows[0, 1] = NOMINAL[0, 1]
    return rows


def _screw(axis, angle_deg, slide_m):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler(axis, angle_deg, degrees=True).as_matrix()
    pose["xyz".index(axis), 3] = slide_m
    return pose


def _digits(values):
    return " ".join(repr(float(v)) for v in values)


def _attributes(pose):
    x, y, z, w = Rotation.from_matrix(pose[:3, :3]).as_quat()
    return f'pos="{_digits(pose[:3, 3])}" quat="{_digits((w, x, y, z))}"'


def _mass(kg, at, half_m):
    size = np.maximum(np.abs(half_m), 0.02)
    inertia = kg / 3 * (np.sum(size**2) - size**2)
    return f'<inertial pos="{at[0]} {at[1]} {at[2]}" mass="{kg}" diaginertia="{inertia[0]} {inertia[1]} {inertia[2]}"/>'


def describe(rows, hidden):
    """MJCF of the machine."""
    fixed = lambda row: _screw("z", 0, row[1]) @ _screw("x", row[3], row[2])
    turn = [_screw("z", row[0], 0) for row in rows]
    elbow = fixed(rows[1]) @ _screw("y", np.degrees(hidden.skew_rad), 0) @ turn[2]
    wrist = fixed(rows[2]) @ turn[3] @ fixed(rows[3])
    reach = wrist[:3, 3]
    friction, spring, gap = hidden.link_friction_nm, hidden.spring_nm_rad, hidden.gap_rad
    joint = lambda k: f'<joint name="q{k + 1}" axis="0 0 1" frictionloss="{friction[k]}" damping="0.05" armature="0.005"/>'
    tip = (
        f'<body name="tip" {_attributes(wrist)}>{_mass(TIP_KG, [0, 0, 0], np.zeros(3))}<site name="tip"/></body>'
    )
    third = f'<body name="link3" {_attributes(elbow)}>{joint(2)}{_mass(LINK_KG[2], reach / 2, reach / 2)}{tip}</body>'
    half = elbow[:3, 3] / 2
    if hidden.beam_nm2 is None:
        inside = _mass(LINK_KG[1], half, half) + third
    else:
        inside = _beam(elbow, hidden.beam_nm2, third)
    second = f'<body name="link2" {_attributes(fixed(rows[0]) @ turn[1])}>{joint(1)}{inside}</body>'
    first = f'<body name="link1" {_attributes(turn[0])}>{joint(0)}{_mass(LINK_KG[0], [0, 0, 0.03], np.zeros(3))}{second}</body>'
    rocking = "" if hidden.rocking_nm_rad is None else "".join(
        f'<joint name="rock{a}" axis="{a}" stiffness="{hidden.rocking_nm_rad}" damping="15" armature="0.1"/>'
        for a in ("1 0 0", "0 1 0")
    )
    motors = "".join(
        f'<body name="m{k}"><joint name="m{k}" axis="0 0 1" armature="0.2" damping="0.3" '
        f'frictionloss="{hidden.motor_friction_nm[k - 1]}"/>{_mass(0.001, [0, 0, 0], np.zeros(3))}</body>'
        for k in (1, 2, 3)
    )
    mixed = f'<joint joint="q2" coef="{-hidden.pulley_mismatch}"/>' if hidden.pulley_mismatch else ""
    gears = "".join(
        f'<fixed name="gear{k}" stiffness="{spring[k - 1]}" damping="{_damping(spring[k - 1])}" '
        f'springlength="{-gap[k - 1] / 2} {gap[k - 1] / 2}">'
        f'<joint joint="m{k}" coef="1"/><joint joint="q{k}" coef="-1"/>{mixed if k == 3 else ""}</fixed>'
        for k in (1, 2, 3)
    )
    servos = "".join(
        f'<position name="servo{k}" joint="m{k}" kp="{KP_NM_RAD[k - 1]}" kv="{0.05 * KP_NM_RAD[k - 1]}"/>' for k in (1, 2, 3)
    )
    base = f'<body name="base">{rocking}{_mass(3.0, [0, 0, 0.02], np.zeros(3))}{first}</body>'
    hand = '<body name="hand" mocap="true"><site name="palm"/></body>'
    grip = (
        '<connect name="grip" site1="tip" site2="palm" active="false" solref="0.02 1" '
        'solimp="0.999 0.9999 0.001"/>'
    )
    return (
        f'<mujoco><option timestep="{STEP_S}" integrator="implicitfast" gravity="0 0 -9.81"/>'
        f"<worldbody>{hand}{base}{motors}</worldbody><tendon>{gears}</tendon>"
        f"<actuator>{servos}</actuator><equality>{grip}</equality></mujoco>"
    )


def _damping(stiffness):
    """Of a gear: a tenth of critical against the lighter of what it joins."""
    return min(0.2 * np.sqrt(stiffness * 0.05), 20.0)


def _beam(elbow, bending_nm2, third):
    """Link 2 as rigid parts with springs between them: n of them bend like a beam of stiffness EI, k = EI n / L."""
    whole, inside = elbow[:3, 3], third
    part = whole / BEAM_PARTS
    stiffness = bending_nm2 * BEAM_PARTS / np.linalg.norm(whole)
    last = elbow.copy()
    last[:3, 3] = part / 2
    for k in reversed(range(BEAM_PARTS)):
        if k == BEAM_PARTS - 1:
            inside = third.replace(_attributes(elbow), _attributes(last))
        at = part / 2 if k == 0 else part
        spring = f'<joint name="bend{k}" axis="0 0 1" stiffness="{stiffness}" damping="3" armature="0.02"/>'
        mass = _mass(LINK_KG[1] / BEAM_PARTS, [0, 0, 0], part / 2)
        inside = f'<body pos="{at[0]} {at[1]} {at[2]}">{spring}{mass}{inside}</body>'
    return _mass(0.001, [0, 0, 0], np.zeros(3)) + inside


class Machine:
    """A running arm: a servo or a hand moves it, and it answers with what it is and what it reads."""

    def __init__(self, rows, hidden):
        self.hidden = hidden
        self.model = mujoco.MjModel.from_xml_string(describe(rows, hidden))
        self.data = mujoco.MjData(self.model)
        self._grown = [(k, self.model.body_pos[k].copy()) for k in range(self.model.nbody)]
        self._reach = self.model.body_pos[self.model.body("tip").id].copy()
        self._motors = [self.model.joint(f"m{k}").qposadr[0] for k in (1, 2, 3)]
        self._links = [self.model.joint(f"q{k}").qposadr[0] for k in (1, 2, 3)]
        self._gains = self.model.actuator_gainprm[:, 0].copy(), self.model.actuator_biasprm[:, 1:3].copy()
        self._integral = np.zeros(3)
        self._teeth = np.zeros(3)
        self.servo = True

    def place(self, joint_rad):
        """Puts the arm down at rest."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[self._links] = joint_rad
        self.data.qpos[self._motors] = joint_rad
        self.data.qpos[self._motors[2]] += self.hidden.pulley_mismatch * joint_rad[1]
        self._integral[:] = 0
        mujoco.mj_forward(self.model, self.data)

    def drift(self, warmer_k, share, teeth_rad, tool_m):
        """What the time of day does: lengths, belts, teeth that jumped, a tool that was knocked [flange frame]."""
        for k, at in self._grown:
            self.model.body_pos[k] = at * (1 + self.hidden.growth_per_k * warmer_k)
        self.model.body_pos[self.model.body("tip").id] += tool_m
        offset = teeth_rad + self.hidden.creep_rad * share
        half = self.hidden.gap_rad / 2
        self.model.tendon_lengthspring[:] = np.stack([offset - half, offset + half], axis=1)

    def drive(self, set_rad, seconds):
        """The servo holds a set-point: stiff, with an integral that creeps."""
        self._switch(True)
        motor = self.data.qpos[self._motors]
        self._integral += 6.0 * seconds * np.clip(set_rad - motor, -0.01, 0.01)
        self.data.ctrl[:] = set_rad + self._integral
        mujoco.mj_step(self.model, self.data, int(round(seconds / STEP_S)))

    def lead(self, at_m, seconds):
        """A hand holds the tip at a point [base frame]; the motors are off and follow through their gears."""
        self._switch(False)
        self.data.mocap_pos[0] = at_m
        mujoco.mj_step(self.model, self.data, int(round(seconds / STEP_S)))

    def _switch(self, servo):
        if servo == self.servo:
            return
        self.servo = servo
        gain, bias = self._gains
        self.model.actuator_gainprm[:, 0] = gain * servo
        self.model.actuator_biasprm[:, 1:3] = bias * servo
        self.data.eq_active[0] = not servo
        self._integral[:] = 0

    @property
    def motor_rad(self):
        return self.data.qpos[self._motors].copy()

    @property
    def tip_m(self):
        """Where the tip is, in the frame of the floor under the base."""
        return self.data.site("tip").xpos.copy()

    @property
    def tip_rotation(self):
        return self.data.site("tip").xmat.reshape(3, 3).copy()
