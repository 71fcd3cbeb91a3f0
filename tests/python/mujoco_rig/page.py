"""The table of a judgement, as a page of docs/."""
import statistics

COLUMNS = ["first", "first, and more", "in the answer", "unknown", "unexplained", "not shown", "silent"]
COLUMNS += ["wrong set", "wrong name", "setup"]
HEAD = """# The rig in another physics engine

Written in one go: `PYTHONPATH=tests/python {command}`

Sessions of the paper's rig simulated by MuJoCo (`tests/python/mujoco_rig`, which shares no formula with armcal): links in gravity,
motors behind gears with gaps and springs, dry friction, a servo with an integral, a hand that leads the tip from cavity to
cavity while the motors are off. Three tilts of the board, 150 dwells seated by hand, 36 poses that the servo holds, geometry
errors of up to 3 mm and 1 deg, one mechanism hidden. armcal sees recordings and the nominal arm; the truth is opened afterwards.

*first*: a true name is told first, and nothing untrue; *first, and more*: with another name that is not true; *in the answer*:
among names that the data do not tell apart; *unknown*: something unlisted is said to be missing; *unexplained*: errors above the
floor, said so without a name; *not shown*: within 1.1 of the floor without it, or said to be nothing below 1.5; *silent*: nothing
missing above 1.5 floors; *wrong set*, *wrong name*: none of the names, or one told alone, is true; *setup*: stopped before any
physics. Held-out mean error over the noise floor before and after `armcal add suggested`: medians; *at floor*: share
within {at_floor} of it afterwards. The floor afterwards is that of the model with what was added: where a joint rests anywhere
in a play that was found, it counts that.

"""


def write(path, counts, floors, ask, at_floor):
    """Writes the page."""
    words = f"python -m mujoco_rig.judge armcal FOLDER --seeds {ask.seeds} --from {ask.first} --nothing {ask.nothing}"
    table = "| hidden | n | " + " | ".join(COLUMNS) + " | before | after | at floor |\n"
    table += "|---|" + "--:|" * (len(COLUMNS) + 4) + "\n"
    for mechanism, said in counts.items():
        before, after = zip(*floors[mechanism])
        cells = [mechanism, sum(said.values()), *(said[c] or "" for c in COLUMNS)]
        cells += [f"{statistics.median(before):.2f}", f"{statistics.median(after):.2f}"]
        cells.append(f"{sum(a <= at_floor for a in after)}/{len(after)}")
        table += "| " + " | ".join(map(str, cells)) + " |\n"
    with open(path, "w") as out:
        out.write(HEAD.format(command=words, at_floor=at_floor) + table)
