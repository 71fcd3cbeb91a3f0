"""A calibrated arm in Python: the ``model.json`` of ``armcal run`` as a function.

    from armcal_kinematics import Arm

    arm = Arm.open("out/model.json")
    motion = arm.motion(in_base=True)
    motion.start([0.0, -0.5, 0.2])          # where the arm waits [rad]
    motion.tip([0.1, -0.4, 0.3])            # Pose(position_m, quaternion_xyzw), effects included
    motion.correct([0.1, -0.4, 0.3])        # SetPoint: what to command so that the tip is where nominal joints would have it

Joints in [rad] (sliding: [m]), metres, kilograms, degrees Celsius. An ``Arm`` may be used by any number of threads; so may a
``Motion``, whose calls wait for each other, and each goes on from where the one before left the arm. What goes wrong is a
:class:`KinematicsError`. Nothing but Python is needed: the shared library is in the package.
"""

import ctypes
import functools
import math
import os
import sys
import threading
from typing import List, NamedTuple, Optional, Sequence, Tuple

__all__ = ["Arm", "KinematicsError", "Motion", "Pose", "Reached", "SetPoint", "version"]

_DOUBLE = ctypes.POINTER(ctypes.c_double)


class _Conditions(ctypes.Structure):
    _fields_ = [
        ("tip", ctypes.c_size_t),
        ("in_base", ctypes.c_int32),
        ("recording", ctypes.c_int32),
        ("load_kg", ctypes.c_double),
        ("temperature_c", ctypes.c_double),
    ]


class _Pose(ctypes.Structure):
    _fields_ = [("position_m", ctypes.c_double * 3), ("quaternion_xyzw", ctypes.c_double * 4)]


class _Reached(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double) for name in ("before_m", "after_m", "before_rad", "after_rad")]


def _library():
    name = {"darwin": "libarmcal_kinematics.dylib", "win32": "armcal_kinematics.dll"}.get(
        sys.platform, "libarmcal_kinematics.so"
    )
    beside = os.path.join(os.path.dirname(os.path.abspath(__file__)), name)
    library = ctypes.CDLL(os.environ.get("ARMCAL_KINEMATICS_LIBRARY", beside))
    handle, double, size, text = ctypes.c_void_p, ctypes.c_double, ctypes.c_size_t, ctypes.c_char_p
    for function, result, arguments in [
        ("version", text, []),
        ("error", text, []),
        ("arm_load", ctypes.c_int32, [text, size, ctypes.POINTER(handle)]),
        ("arm_free", None, [handle]),
        ("arm_joints", size, [handle]),
        ("arm_slides", ctypes.c_int32, [handle, size]),
        ("arm_name", text, [handle, ctypes.c_uint32, size]),
        ("motion_new", ctypes.c_int32, [handle, ctypes.POINTER(_Conditions), ctypes.POINTER(handle)]),
        ("motion_free", None, [handle]),
        ("motion_start", ctypes.c_int32, [handle, _DOUBLE]),
        ("motion_go", ctypes.c_int32, [handle, _DOUBLE]),
        ("motion_tip", ctypes.c_int32, [handle, _DOUBLE, _DOUBLE, _DOUBLE, _DOUBLE, ctypes.POINTER(_Pose)]),
        ("motion_nominal_tip", ctypes.c_int32, [handle, _DOUBLE, ctypes.POINTER(_Pose)]),
        ("motion_correct", ctypes.c_int32, [handle, _DOUBLE, double] + 2 * [_DOUBLE] + [ctypes.POINTER(_Reached)]),
        (
            "motion_set_point",
            ctypes.c_int32,
            [handle, _DOUBLE, _DOUBLE, double] + 3 * [_DOUBLE] + [ctypes.POINTER(_Reached)],
        ),
        (
            "motion_path",
            ctypes.c_int32,
            [handle, _DOUBLE, _DOUBLE, size, double, _DOUBLE, _DOUBLE, ctypes.POINTER(ctypes.c_uint8), ctypes.POINTER(_Reached)],
        ),
        ("motion_warnings", text, [handle]),
    ]:
        found = getattr(library, "armcal_" + function)
        found.restype, found.argtypes = result, arguments
    return library


_C = _library()


class KinematicsError(ValueError):
    """What was asked makes no sense, or cannot be reached; ``code`` is that of the C header."""

    def __init__(self, code: int, message: str):
        super().__init__(message)
        self.code = code


class Pose(NamedTuple):
    """Where a tip is."""

    position_m: Tuple[float, ...]
    quaternion_xyzw: Tuple[float, ...]


class Reached(NamedTuple):
    """By how much the tip misses by the calibrated model, at the nominal set-point and at the corrected one; angles are NaN
    where no orientation was asked for."""

    before_m: float
    after_m: float
    before_rad: float
    after_rad: float


class SetPoint(NamedTuple):
    """A set-point."""

    nominal_rad: Tuple[float, ...]
    joint_rad: Tuple[float, ...]
    #: In which direction each joint arrives: +1, -1, 0 where that is not known.
    direction: Tuple[float, ...]
    reached: Reached
    warnings: List[str]
    #: On a path: whether each joint is on its way through its gap, as it turns back; its link waits.
    in_gap: Tuple[bool, ...] = ()


def version() -> str:
    """Version of the library."""
    return _C.armcal_version().decode()


def _checked(code: int) -> None:
    if code != 0:
        raise KinematicsError(code, _C.armcal_error().decode(errors="replace"))


def _numbers(values: Sequence[float], count: int, what: str):
    values = [float(value) for value in values]
    if len(values) != count:
        raise KinematicsError(1, f"{what}: {len(values)} were given, {count} are needed")
    return (ctypes.c_double * count)(*values)


class Arm:
    """A calibrated arm with its effects."""

    def __init__(self, model_json: str):
        """Of the text of a ``model.json``."""
        self._handle = ctypes.c_void_p()
        text = model_json.encode()
        _checked(_C.armcal_arm_load(text, len(text), ctypes.byref(self._handle)))
        self.joints, self.tips, self.recordings, self.effects, self.missing = map(self._names, range(5))

    @classmethod
    def open(cls, path) -> "Arm":
        """Of a ``model.json``, or the folder of results that it is in."""
        path = os.fspath(path)
        with open(os.path.join(path, "model.json") if os.path.isdir(path) else path, encoding="utf-8") as file:
            return cls(file.read())

    def __del__(self):
        if getattr(self, "_handle", None):
            _C.armcal_arm_free(self._handle)

    def _names(self, kind: int) -> List[str]:
        names: List[str] = []
        while (name := _C.armcal_arm_name(self._handle, kind, len(names))) is not None:
            names.append(name.decode())
        return names

    def slides(self, joint: int) -> bool:
        """Whether a joint slides: [m] in the place of [rad]."""
        return bool(_C.armcal_arm_slides(self._handle, joint))

    def motion(
        self,
        tip: Optional[str] = None,
        *,
        in_base: bool = False,
        recording: Optional[str] = None,
        load_kg: Optional[float] = None,
        temperature_c: Optional[float] = None,
    ) -> "Motion":
        """The arm under conditions: which tip (the first), poses in its arm's base or in the world of the measurement, as in
        which recording (the last) with its load and temperature, or with these. From where joints come is not known yet."""
        conditions = _Conditions(
            0 if tip is None else _place(self.tips, tip, "tip"),
            in_base,
            -1 if recording is None else _place(self.recordings, recording, "recording"),
            math.nan if load_kg is None else load_kg,
            math.nan if temperature_c is None else temperature_c,
        )
        return Motion(self, conditions)


def _place(names: List[str], name: str, what: str) -> int:
    if name not in names:
        raise KinematicsError(1, f"there is no {what} `{name}`; there are {', '.join(names)}")
    return names.index(name)


def _alone(method):
    """ctypes lets other threads run during a call, and a motion is for one at a time: they wait until its answer is laid out."""

    @functools.wraps(method)
    def waits(self, *args, **kwargs):
        with self._lock:
            return method(self, *args, **kwargs)

    return waits


class Motion:
    """One arm on its way, which remembers from where each joint came."""

    def __init__(self, arm: Arm, conditions: _Conditions):
        # A handler of a signal may ask in the middle of a call: it is the same thread, between two steps of Python.
        self._lock = threading.RLock()
        self._handle = ctypes.c_void_p()
        self._joints = len(arm.joints)
        _checked(_C.armcal_motion_new(arm._handle, ctypes.byref(conditions), ctypes.byref(self._handle)))

    def __del__(self):
        if getattr(self, "_handle", None):
            _C.armcal_motion_free(self._handle)

    def _of_joints(self, values: Optional[Sequence[float]], what: str):
        return None if values is None else _numbers(values, self._joints, what)

    @_alone
    def start(self, joint_rad: Optional[Sequence[float]]) -> None:
        """The arm waits there, from where it came unknown; None: nobody knows where it waits."""
        _checked(_C.armcal_motion_start(self._handle, self._of_joints(joint_rad, "joints")))

    @_alone
    def go(self, joint_rad: Sequence[float]) -> None:
        """The arm goes there, each joint one way."""
        _checked(_C.armcal_motion_go(self._handle, self._of_joints(joint_rad, "joints")))

    @_alone
    def tip(
        self,
        joint_rad: Sequence[float],
        direction: Optional[Sequence[float]] = None,
        velocity_radps: Optional[Sequence[float]] = None,
        effort_nm: Optional[Sequence[float]] = None,
    ) -> Pose:
        """The tip of the calibrated arm, effects included, were it to go there from where it stands; with directions of
        travel (+1, -1) as if it had come from far away."""
        pose = _Pose()
        vectors = (joint_rad, "joints"), (direction, "directions"), (velocity_radps, "velocities"), (effort_nm, "efforts")
        given = [self._of_joints(values, what) for values, what in vectors]
        _checked(_C.armcal_motion_tip(self._handle, *given, ctypes.byref(pose)))
        return Pose(tuple(pose.position_m), tuple(pose.quaternion_xyzw))

    @_alone
    def nominal_tip(self, joint_rad: Sequence[float]) -> Pose:
        """The tip as a controller that knows nothing of the calibration has it."""
        pose = _Pose()
        _checked(_C.armcal_motion_nominal_tip(self._handle, self._of_joints(joint_rad, "joints"), ctypes.byref(pose)))
        return Pose(tuple(pose.position_m), tuple(pose.quaternion_xyzw))

    @_alone
    def correct(self, nominal_rad: Sequence[float], time_s: Optional[float] = None) -> SetPoint:
        """The set-point that brings the tip to where the nominal arm has it at these joints; then the arm stands there. With
        a time it is a point of a path."""
        nominal = self._of_joints(nominal_rad, "joints")
        corrected, direction, reached = self._room(), self._room(), _Reached()
        time = math.nan if time_s is None else time_s
        _checked(_C.armcal_motion_correct(self._handle, nominal, time, corrected, direction, ctypes.byref(reached)))
        return self._set_point(nominal, corrected, direction, reached)

    @_alone
    def set_point(
        self,
        position_m: Sequence[float],
        quaternion_xyzw: Optional[Sequence[float]] = None,
        time_s: Optional[float] = None,
    ) -> SetPoint:
        """The set-point that brings the tip to a place, as ``armcal compensate`` finds it; then the arm stands there."""
        position = _numbers(position_m, 3, "position_m")
        turned = None if quaternion_xyzw is None else _numbers(quaternion_xyzw, 4, "quaternion_xyzw")
        nominal, corrected, direction, reached = self._room(), self._room(), self._room(), _Reached()
        time = math.nan if time_s is None else time_s
        _checked(
            _C.armcal_motion_set_point(
                self._handle, position, turned, time, nominal, corrected, direction, ctypes.byref(reached)
            )
        )
        return self._set_point(nominal, corrected, direction, reached)

    @_alone
    def path(
        self, nominal_rad: Sequence[Sequence[float]], time_s: Sequence[float], crossing_s: float = 0.4
    ) -> List[SetPoint]:
        """``correct`` for every point of a path, with rising times; a joint that turns back crosses its gap in ``crossing_s``
        around that moment (0: in one leap). Then the arm stands at the end."""
        count, joints = len(nominal_rad), self._joints
        flat = [float(number) for point in nominal_rad for number in self._of_joints(point, "joints")]
        nominal, times = _numbers(flat, count * joints, "joints"), _numbers(time_s, count, "times")
        corrected, direction = (ctypes.c_double * (count * joints))(), (ctypes.c_double * (count * joints))()
        in_gap, reached = (ctypes.c_uint8 * (count * joints))(), (_Reached * count)()
        _checked(
            _C.armcal_motion_path(self._handle, nominal, times, count, crossing_s, corrected, direction, in_gap, reached)
        )
        warnings: List[List[str]] = [[] for _ in range(count)]
        for line in _C.armcal_motion_warnings(self._handle).decode().splitlines():
            point, words = line.split(": ", 1)
            warnings[int(point)].append(words)
        return [
            self._laid_out(nominal[at], corrected[at], direction[at], reached[k], warnings[k], tuple(map(bool, in_gap[at])))
            for k in range(count)
            for at in [slice(k * joints, (k + 1) * joints)]
        ]

    def _room(self):
        return (ctypes.c_double * self._joints)()

    def _set_point(self, nominal, corrected, direction, reached) -> SetPoint:
        warnings = _C.armcal_motion_warnings(self._handle).decode().splitlines()
        return self._laid_out(nominal, corrected, direction, reached, warnings)

    @staticmethod
    def _laid_out(nominal, corrected, direction, reached, warnings, in_gap=()) -> SetPoint:
        numbers = Reached(reached.before_m, reached.after_m, reached.before_rad, reached.after_rad)
        return SetPoint(tuple(nominal), tuple(corrected), tuple(direction), numbers, warnings, in_gap)
