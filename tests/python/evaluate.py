"""Answers what crates/kinematics/examples/evaluate.c answers, through the Python module: evaluate.py MODEL base|world."""

import sys

from armcal_kinematics import Arm, KinematicsError

arm = Arm.open(sys.argv[1])
motion = arm.motion(in_base=sys.argv[2] == "base")
for line in sys.stdin:
    word, *given = line.split()
    given = [float(number) for number in given]
    answer = []
    if word in ("correct", "place"):
        if word == "correct":
            point = motion.correct(given)
        else:
            point = motion.set_point(given[:3], given[3:] or None)
            answer += point.nominal_rad
        answer += point.joint_rad + point.direction + point.reached
    elif word == "path":
        rows = [given[k : k + 1 + len(arm.joints)] for k in range(1, len(given), 1 + len(arm.joints))]
        for point in motion.path([row[1:] for row in rows], [row[0] for row in rows], given[0]):
            answer += point.joint_rad + point.direction + point.in_gap + point.reached
    elif word in ("start", "go"):
        getattr(motion, word)(given)
    else:
        pose = {
            "tip": lambda: motion.tip(given),
            "rising": lambda: motion.tip(given, [1] * len(given)),
            "nominal": lambda: motion.nominal_tip(given),
        }[word]()
        answer += pose.position_m + pose.quaternion_xyzw
    print("".join(f"{number:.17g} " for number in answer))

# Errors carry their words, and leave the motion as it was.
for attempt in (
    lambda: Arm("{}"),
    lambda: arm.motion("no such tip"),
    lambda: arm.motion(load_kg=-1.0),
    lambda: motion.tip([0.0]),
    lambda: motion.tip([float("nan")] * len(arm.joints)),
    lambda: motion.set_point([9.0, 0.0, 0.0]),
    lambda: motion.path([[0.0] * len(arm.joints)] * 2, [1.0, 1.0]),
):
    try:
        attempt()
    except KinematicsError as error:
        print(f"error {error.code}: {error}", file=sys.stderr)
    else:
        sys.exit("no error")
