"""usage: python -m mujoco_rig.judge ARMCAL FOLDER [--seeds N] [--from K] [--nothing N] [--only A,B] [--page PAGE.md]

Makes sessions in FOLDER, asks armcal what is missing, adds what it suggests, opens the truth afterwards and counts. What
was said of a session stays in FOLDER, so that a judgement that was broken off goes on. The last line is JSON.
"""
import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
from collections import Counter, defaultdict
from concurrent.futures import ThreadPoolExecutor

from .hidden import MECHANISMS
from .page import write

ABOVE_FLOOR = 1.5  # an error larger than so many floors may not go without a word
AT_FLOOR = 1.1


def _armcal(program, *words):
    ran = subprocess.run([program, *words, "--json"], capture_output=True, text=True)
    stopped = {"verdict": "setup", "effects": [], "error": (ran.stdout + ran.stderr).strip()}
    try:
        return json.loads(ran.stdout) or stopped
    except json.JSONDecodeError:
        return stopped


def session(program, folder, mechanism, seed):
    """Makes one session, asks, adds what is suggested; the recordings go, what was said stays."""
    path = os.path.join(folder, f"{mechanism}-{seed}")
    if not os.path.exists(f"{path}-said.json"):
        make = [sys.executable, "-m", "mujoco_rig", mechanism, str(seed), path]
        subprocess.run(make, check=True, stdout=subprocess.DEVNULL)
        said = {"diagnosis": _armcal(program, "diagnose", f"{path}/pipeline.toml")}
        if any(e["set"] for e in said["diagnosis"]["effects"]):
            added = _armcal(program, "add", "suggested", f"{path}/pipeline.toml", "--out", f"{path}/out")
            said["after_mm"] = added.get("comparison", {}).get("held_out", {}).get("after_mm")
            said["floor_after_mm"] = added.get("remaining", {}).get("floor_mm")
        with open(f"{path}-said.json", "w") as out:
            json.dump(said, out)
        shutil.rmtree(path)
    with open(f"{path}-truth.json") as truth, open(f"{path}-said.json") as said:
        return json.load(truth), json.load(said)


def is_true(name, accept):
    """Whether a name, or a member of a group, is one of the truths: `frame_shift@1.20` is a `frame_shift`."""
    return any(part == a or part.startswith((f"{a}@", f"{a},")) for part in name.split("+") for a in accept)


def judged(truth, found):
    """One of the columns of the table for what armcal said of a session."""
    if found["verdict"] == "setup":
        return "setup"
    floors = found["holdout_mm"]["before"] / found["floor_mm"]
    sets = [e["set"] for e in found["effects"]]
    true = [any(is_true(name, truth["accept"]) for name in names) for names in sets]
    if found["verdict"] in ("nothing_missing", "unexplained") and floors <= AT_FLOOR:
        return "at the floor"
    if found["verdict"] == "nothing_missing":
        return "silent" if floors > ABOVE_FLOOR else "not shown"
    if any(len(names) == 1 and not right for names, right in zip(sets, true)):
        return "first, and more" if true[0] and is_true(sets[0][0], truth["accept"]) else "wrong name"
    if sets and is_true(sets[0][0], truth["accept"]):
        return "first" if all(true) else "first, and more"
    if any(true):
        return "in the answer"
    return "wrong set" if sets else found["verdict"]


def main():
    ask = argparse.ArgumentParser()
    ask.add_argument("armcal")
    ask.add_argument("folder")
    ask.add_argument("--seeds", type=int, default=2)
    ask.add_argument("--from", type=int, default=1, dest="first")
    ask.add_argument("--nothing", type=int, default=0)
    ask.add_argument("--only", default="")
    ask.add_argument("--jobs", type=int, default=os.cpu_count())
    ask.add_argument("--page")
    ask = ask.parse_args()
    os.makedirs(ask.folder, exist_ok=True)
    only = [m for m in ask.only.split(",") if m] or [m for m in MECHANISMS if m != "nothing"]
    wanted = [(m, ask.first + k) for m in only for k in range(ask.seeds)]
    wanted += [("nothing", ask.first + k) for k in range(ask.nothing)]
    with ThreadPoolExecutor(ask.jobs) as pool:
        done = list(pool.map(lambda w: session(ask.armcal, ask.folder, *w), wanted))
    counts, floors = defaultdict(Counter), defaultdict(list)
    for truth, said in done:
        found = said["diagnosis"]
        word = judged(truth, found)
        counts[truth["mechanism"]][word] += 1
        floor = found.get("floor_mm") or float("nan")
        before = found.get("holdout_mm", {}).get("before", float("nan"))
        after = said.get("after_mm")
        floor_after = said.get("floor_after_mm") or floor
        floors[truth["mechanism"]].append((before / floor, after / floor_after if after else before / floor))
        names = "; ".join(" or ".join(e["set"][:4]) for e in found["effects"])
        hidden = f"{truth['mechanism']:12} {truth['seed']:5} {truth['size']:8.3f} {truth['unit']:6}"
        fell = "{:6.2f} -> {:5.2f} floors".format(*floors[truth["mechanism"]][-1])
        print(f"{hidden} {word:16} {fell}  {names or found['verdict']}")
    if ask.page:
        write(ask.page, counts, floors, ask, AT_FLOOR)
    median = {m: statistics.median(after for _, after in all) for m, all in floors.items()}
    print(json.dumps({"counts": counts, "after_floors": median}))


if __name__ == "__main__":
    main()
