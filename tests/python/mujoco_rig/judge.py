"""usage: python -m mujoco_rig.judge ARMCAL FOLDER [--seeds N] [--from K] [--nothing N] [--only A,B] [--out TABLE.md]

Makes sessions in FOLDER, asks armcal what is missing, adds what it suggests, opens the truth afterwards and counts.
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

ABOVE_FLOOR = 1.5  # an error larger than so many floors may not go without a word
AT_FLOOR = 1.1
WORDS = ["first", "first, and more", "in the answer", "unknown", "unexplained", "not shown", "silent", "wrong set", "wrong name", "setup"]


def _armcal(program, *words):
    ran = subprocess.run([program, *words, "--json"], capture_output=True, text=True)
    try:
        return json.loads(ran.stdout)
    except json.JSONDecodeError:
        return {"verdict": "setup", "effects": [], "error": (ran.stdout + ran.stderr).strip()}


def session(program, folder, mechanism, seed):
    """Makes one session, asks, adds what is suggested; the recordings go, what was said stays."""
    path = os.path.join(folder, f"{mechanism}-{seed}")
    if not os.path.exists(f"{path}-said.json"):
        make = [sys.executable, "-m", "mujoco_rig", mechanism, str(seed), path]
        subprocess.run(make, check=True, stdout=subprocess.DEVNULL)
        said = {"diagnosis": _armcal(program, "diagnose", f"{path}/pipeline.toml")}
        if any(e["set"] for e in said["diagnosis"]["effects"]):
            said["added"] = _armcal(program, "add", "suggested", f"{path}/pipeline.toml", "--out", f"{path}/out")
        with open(f"{path}-said.json", "w") as out:
            json.dump(said, out)
        shutil.rmtree(path)
    with open(f"{path}-truth.json") as truth, open(f"{path}-said.json") as said:
        return json.load(truth), json.load(said)


def is_true(name, accept):
    """Whether a name, or a member of a group, is one of the truths: `frame_shift@1.20` is a `frame_shift`."""
    return any(part == a or part.startswith((f"{a}@", f"{a},")) for part in name.split("+") for a in accept)


def judged(truth, found):
    """One of WORDS for what armcal said of a session."""
    if found["verdict"] == "setup":
        return "setup"
    floors = found["holdout_mm"]["before"] / found["floor_mm"]
    sets = [e["set"] for e in found["effects"]]
    true = [any(is_true(name, truth["accept"]) for name in names) for names in sets]
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
    ask.add_argument("--out")
    ask = ask.parse_args()
    os.makedirs(ask.folder, exist_ok=True)
    only = [m for m in ask.only.split(",") if m] or [m for m in MECHANISMS if m != "nothing"]
    wanted = [(m, ask.first + k) for m in only for k in range(ask.seeds)]
    wanted += [("nothing", ask.first + k) for k in range(ask.nothing)]
    with ThreadPoolExecutor(int(os.environ.get("JOBS", os.cpu_count()))) as pool:
        done = list(pool.map(lambda w: session(ask.armcal, ask.folder, *w), wanted))
    counts, floors = defaultdict(Counter), defaultdict(list)
    for truth, said in done:
        found = said["diagnosis"]
        word = judged(truth, found)
        counts[truth["mechanism"]][word] += 1
        before = found.get("holdout_mm", {}).get("before", float("nan")) / (found.get("floor_mm") or 1)
        after = said.get("added", {}).get("over_floor", before)
        floors[truth["mechanism"]].append((before, after))
        names = "; ".join(" or ".join(e["set"][:4]) for e in found["effects"])
        print(f"{truth['mechanism']:12} {truth['seed']:5} {truth['size']:8.3f} {truth['unit']:5} {word:16} {before:6.2f} floors  {names}")
    table = ["| hidden | n | " + " | ".join(WORDS) + " | before/floor |", "|---|--:|" + "--:|" * (len(WORDS) + 1)]
    for mechanism, words in counts.items():
        row = [mechanism, str(sum(words.values()))] + [str(words[w] or "") for w in WORDS]
        table.append("| " + " | ".join(row) + f" | {statistics.median(b for b, _ in floors[mechanism]):.2f} |")
    print("\n".join(table))
    if ask.out:
        with open(ask.out, "w") as out:
            out.write("\n".join(table) + "\n")


if __name__ == "__main__":
    main()
