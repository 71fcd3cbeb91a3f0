"""One arm and one motion of the Python module, used by many threads at once: threads.py MODEL."""

import sys
import threading

from armcal_kinematics import Arm, KinematicsError

THREADS, ROUNDS = 8, 150
arm = Arm.open(sys.argv[1])
shared = arm.motion()
sys.setswitchinterval(1e-6)


def joints(thread, step):
    return [0.02 * (1 + (7 * thread + 3 * step + joint) % 11) for joint in range(len(arm.joints))]


def alone(thread):
    """What a thread's own motion answers."""
    motion = arm.motion()
    motion.start(joints(thread, 0))
    # As text: what is not known is NaN, which is equal to nothing.
    return repr([motion.correct(joints(thread, step)) for step in range(1, ROUNDS)])


expected = [alone(thread) for thread in range(THREADS)]
wrong = []


def work(thread):
    if alone(thread) != expected[thread]:
        wrong.append(f"thread {thread}: its own motion answers otherwise")
    for step in range(ROUNDS):
        asked = joints(thread, step)
        tip = shared.nominal_tip(asked)
        shared.start(asked)
        point = shared.correct(asked)
        path = shared.path([asked, joints(thread, step + 1)], [0.0, 5.0])
        if list(point.nominal_rad) != asked or list(path[0].nominal_rad) != asked:
            wrong.append(f"thread {thread}, step {step}: the answer is to another question")
        if shared.nominal_tip(asked) != tip:
            wrong.append(f"thread {thread}, step {step}: the nominal arm moved")
        if any(not isinstance(words, str) for one in [point, *path] for words in one.warnings):
            wrong.append(f"thread {thread}, step {step}: warnings that are none")
        try:
            shared.set_point([99.0 + thread, 0.0, 0.0])
            wrong.append(f"thread {thread}: 99 m away, and reached")
        except KinematicsError as error:
            if "away from it" not in str(error):
                wrong.append(f"thread {thread}: {error}")


threads = [threading.Thread(target=work, args=[number]) for number in range(THREADS)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
sys.exit("\n".join(wrong[:10]) or 0)
