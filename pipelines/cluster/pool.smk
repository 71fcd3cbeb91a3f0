# A pool in shards as a Snakemake workflow: rounds of SHARDS jobs and one that puts their answers together, until it is done.
#
#   snakemake -s pipelines/cluster/pool.smk --cores 8 --config results=R pipeline=P out=D shards=4
#
# On a cluster add an executor (`--executor slurm --jobs 50`); paths must mean the same on every node.
import os

ARMCAL = os.environ.get("ARMCAL", "armcal")
RESULTS, PIPELINE, OUT = (os.path.abspath(config[name]) for name in ("results", "pipeline", "out"))
SHARDS = int(config["shards"])


# Which rounds there will be, only their answers tell: each reduction is a checkpoint, after which this is asked again.
def all_rounds(wildcards):
    number, reduced = 0, []
    while True:
        reduced.append(checkpoints.reduce.get(number=number).output[0])
        with open(reduced[-1]) as ended:
            if ended.read().strip() == "done":
                return reduced
        number += 1


rule pool:
    input:
        all_rounds,


rule map:
    input:
        lambda wildcards: f"{OUT}/rounds/{int(wildcards.number) - 1}/reduced" if int(wildcards.number) else PIPELINE,
    output:
        f"{OUT}/rounds/{{number}}/{{shard}}-of-{SHARDS}",
    threads: 2
    shell:
        "{ARMCAL:q} map --pool {RESULTS:q} --pipeline {PIPELINE:q} --out {OUT:q} --shard {wildcards.shard}/{SHARDS}"


# Exit code 4: another round; 3: the result is doubtful, which it says, and is written all the same.
checkpoint reduce:
    input:
        expand(f"{OUT}/rounds/{{{{number}}}}/{{shard}}-of-{SHARDS}", shard=range(1, SHARDS + 1)),
    output:
        f"{OUT}/rounds/{{number}}/reduced",
    shell:
        "set +e; {ARMCAL:q} reduce {OUT:q}; case $? in 0|3) echo done;; 4) echo again;; *) exit 1;; esac > {output:q}"
