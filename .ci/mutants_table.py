#!/usr/bin/env python3
"""Prints what `cargo mutants` found as the table of docs/mutation-testing.md: .ci/mutants_table.py [OUTCOMES.JSON ...]

Of a mutant that was tried more than once the latest result counts."""

import json
import sys
from collections import defaultdict
from pathlib import Path

results = {}
for path in sys.argv[1:] or ["target/mutants.out/outcomes.json"]:
    for outcome in json.loads(Path(path).read_text())["outcomes"]:
        if outcome["scenario"] != "Baseline":
            mutant = outcome["scenario"]["Mutant"]
            results[mutant["name"]] = (mutant["file"], outcome["summary"])
files, survivors = defaultdict(lambda: defaultdict(int)), []
for name, (file, summary) in results.items():
    files[file][summary] += 1
    if summary == "MissedMutant":
        survivors.append(name)

print("| file | mutants | killed | survive | do not compile |")
print("|---|---|---|---|---|")
for file, counts in sorted(files.items()):
    killed = counts["CaughtMutant"] + counts["Timeout"]
    missed, broken = counts["MissedMutant"], counts["Unviable"]
    share = 100 * killed / max(killed + missed, 1)
    print(f"| `{file}` | {killed + missed} | {killed} ({share:.0f} %) | {missed} | {broken} |")
print()
for name in sorted(survivors):
    print(f"- `{name}`")
