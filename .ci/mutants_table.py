#!/usr/bin/env python3
"""Prints what `cargo mutants` found as the table of docs/mutation-testing.md: .ci/mutants_table.py [OUTCOMES.JSON]"""

import json
import sys
from collections import defaultdict
from pathlib import Path

path = Path(sys.argv[1] if len(sys.argv) > 1 else "target/mutants.out/outcomes.json")
files, survivors = defaultdict(lambda: defaultdict(int)), []
for outcome in json.loads(path.read_text())["outcomes"]:
    scenario = outcome["scenario"]
    if scenario == "Baseline":
        continue
    mutant = scenario["Mutant"]
    files[mutant["file"]][outcome["summary"]] += 1
    if outcome["summary"] == "MissedMutant":
        survivors.append(mutant["name"])

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
