"""The table of a judgement, as a page of docs/."""
import statistics

ANSWERED = ["first", "first, and more", "in the answer"]
UNSEEN = "at the floor"
COLUMNS = [*ANSWERED, UNSEEN, "not shown", "unknown", "unexplained", "silent", "wrong set", "wrong name", "setup"]
HEAD = """# The rig in another physics engine

Written in one go: `PYTHONPATH=tests/python {command}`

Sessions of the paper's rig simulated by MuJoCo (`tests/python/mujoco_rig`, which shares no formula with armcal): links in gravity,
motors behind gears with gaps and springs, dry friction, a servo with an integral, a hand that leads the tip from cavity to
cavity while the motors are off. Three tilts of the board, 150 dwells seated by hand, 36 poses that the servo holds, geometry
errors of up to 3 mm and 1 deg, one mechanism hidden. armcal sees recordings and the nominal arm; the truth is opened afterwards.

*first*: a true name is told first, and nothing untrue; *first, and more*: with another name that is not true; *in the answer*:
among names that the data do not tell apart; *at the floor*: no name, and no need of one: the model without what is hidden errs within {at_floor} of
the floor on points it never saw (a joint that rests on one flank of its play in every pose, friction that winds up nothing);
*not shown*: said to be nothing up to 1.5 floors; *unknown*: something unlisted is said to be missing; *unexplained*: errors above the
floor, said so without a name; *silent*: nothing missing above 1.5 floors; *wrong set*, *wrong name*: none of the names, or one told
alone, is true; *setup*: stopped before any physics. Held-out mean error over the declared noise before and after `armcal add
suggested`: medians; *at floor*: share within {at_floor} of it afterwards. The floor afterwards is that of the model with what was
added: where a joint rests anywhere in a play that was found, it counts that.

"""
TOTAL = """
Of {n} sessions that hide something, {seen} err above {at_floor} floors without it or were named all the same. Of those {seen} the truth is in
the answer in {answered} ({answered_percent:.0f} %), first and alone in {first} ({first_percent:.0f} %). Names told alone that are
not true: {wrong}. Of all {n}, {at} are within {at_floor} floors after `armcal add suggested` ({at_percent:.0f} %).
"""


def total(counts, floors, at_floor):
    """The numbers of the whole table, but for the sessions that hide nothing."""
    hiding = [m for m in counts if m != "nothing"]
    said = {word: sum(counts[m][word] for m in hiding) for word in COLUMNS}
    n = sum(said.values())
    seen, answered = n - said[UNSEEN], sum(said[word] for word in ANSWERED)
    at = sum(after <= at_floor for m in hiding for _, after in floors[m])
    share = lambda part, whole: 100 * part / max(whole, 1)
    return TOTAL.format(
        n=n, seen=seen, at_floor=at_floor, answered=answered, answered_percent=share(answered, seen), first=said["first"],
        first_percent=share(said["first"], seen), wrong=said["wrong name"], at=at, at_percent=share(at, n),
    )



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
        out.write(HEAD.format(command=words, at_floor=at_floor) + table + total(counts, floors, at_floor))
