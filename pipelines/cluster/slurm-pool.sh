#!/usr/bin/env bash
# A pool in shards: rounds of a Slurm job array and a task that puts its answers together and submits the next round.
#
#   pipelines/cluster/slurm-pool.sh RESULTS PIPELINE OUT SHARDS [sbatch options for the tasks, such as --mem=4G]
#
# Paths must mean the same on every node. A pool takes some 40 to 100 rounds, 400 at most (or ARMCAL_ROUNDS), and
# a round takes Slurm some seconds. Submitting the same again goes on where a cancelled or failed one stopped.
set -euo pipefail
if [ $# -lt 4 ]; then
    sed -n '2,7s/^# \{0,1\}//p' "$0" >&2
    exit 2
fi
self=$(realpath "$0") results=$(realpath "$1") pipeline=$(realpath "$2") out=$(realpath -m "$3") shards=$4
shift 4
armcal=${ARMCAL:-armcal} left=${ARMCAL_ROUNDS:-400}
if [ "$left" -le 0 ]; then
    echo "no round left: raise ARMCAL_ROUNDS and submit the same again" >&2
    exit 1
fi
mkdir -p "$out/log"

tasks=$(sbatch --parsable --job-name=armcal-map --array="1-$shards" --cpus-per-task=2 --output="$out/log/map-%a.log" "$@" <<TASK
#!/usr/bin/env bash
"$armcal" map --pool "$results" --pipeline "$pipeline" --out "$out"
TASK
)
# 4: another round. 3: the result is doubtful, which it says; it is written all the same. Without kill-on-invalid-dep a failed
# task leaves this one waiting for ever.
whole=$(sbatch --parsable --job-name=armcal-reduce --dependency="afterok:$tasks" --kill-on-invalid-dep=yes \
    --output="$out/log/reduce.log" <<TASK
#!/usr/bin/env bash
"$armcal" reduce "$out"
case \$? in
0 | 3) ;;
4) ARMCAL="$armcal" ARMCAL_ROUNDS=$((left - 1)) exec "$self"$(printf ' %q' "$results" "$pipeline" "$out" "$shards" "$@") ;;
*) exit 1 ;;
esac
TASK
)
echo "tasks $tasks, then $whole; results in $out"
