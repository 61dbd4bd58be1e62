"""Training pictures on an engine: `train pictures` in parts, and once more over all of it, which finds every picture there.

    snakemake --snakefile workflow/pictures.smk --profile profiles/slurm --config models=FOLDER out=FOLDER [parts=8] [options="..."]
"""

import shlex
import sys

for name in ("models", "out"):
    if name not in config:
        sys.exit(f"error: no {name}; expected --config models=FOLDER out=FOLDER")
OUT = config["out"]
PICTURES = f"{sys.executable} -m dreammat_cli train pictures {shlex.quote(config['models'])} -o {shlex.quote(OUT)} -q"
WORDS = shlex.split(config.get("options", ""))


scattergather:
    parts=int(config.get("parts", 8)),


localrules: all


rule all:
    input: f"{OUT}/manifest.json"


rule part:
    output: touch(f"{OUT}/parts/{{scatteritem}}")
    log: f"{OUT}/logs/{{scatteritem}}.log"
    benchmark: f"{OUT}/benchmarks/{{scatteritem}}.tsv"
    params:
        words=WORDS,
        shard=lambda at: at.scatteritem.replace("-of-", "/"),
    resources: mem_mb=lambda at, attempt: 2000 * attempt, runtime=lambda at, attempt: 720 * attempt
    shell: "{PICTURES} {params.words:q} --shard {params.shard} 2> {log:q}"


rule manifest:
    input: gather.parts(f"{OUT}/parts/{{scatteritem}}")
    output: f"{OUT}/manifest.json"
    log: f"{OUT}/logs/manifest.log"
    params: words=WORDS
    resources: mem_mb=2000, runtime=240
    shell: "{PICTURES} {params.words:q} 2> {log:q}"


onstart:  # as in Snakefile
    workflow.scheduler.job_rate_limiter = None
