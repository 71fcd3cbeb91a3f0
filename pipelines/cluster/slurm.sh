#!/usr/bin/env bash
# A batch as a Slurm job array: SHARDS tasks, then one that puts them together.
#
#   pipelines/cluster/slurm.sh MANIFEST PIPELINE OUT SHARDS [sbatch options for the tasks, such as --mem=4G]
#
# Paths must mean the same on every node. A share is worth 50 to 500 recordings: starting a task takes Slurm about a
# second. Submitting the same again goes on where a cancelled or failed one stopped.
set -euo pipefail
if [ $# -lt 4 ]; then
    sed -n '2,7s/^# \{0,1\}//p' "$0" >&2
    exit 2
fi
manifest=$(realpath "$1") pipeline=$(realpath "$2") out=$(realpath -m "$3") shards=$4
shift 4
armcal=${ARMCAL:-armcal}
mkdir -p "$out/log"

# 3: some recordings failed or are doubtful, which the campaign says; the share is done all the same.
tasks=$(sbatch --parsable --job-name=armcal-map --array="1-$shards" --cpus-per-task=2 --output="$out/log/map-%a.log" "$@" <<TASK
#!/usr/bin/env bash
"$armcal" map --manifest "$manifest" --pipeline "$pipeline" --out "$out" --jobs "\$SLURM_CPUS_PER_TASK" || [ \$? -eq 3 ]
TASK
)
# Without kill-on-invalid-dep a failed task leaves this one waiting for ever.
whole=$(sbatch --parsable --job-name=armcal-reduce --dependency="afterok:$tasks" --kill-on-invalid-dep=yes \
    --output="$out/log/reduce.log" <<TASK
#!/usr/bin/env bash
"$armcal" reduce "$out" || [ \$? -eq 3 ]
TASK
)
echo "tasks $tasks, then $whole; results in $out"
