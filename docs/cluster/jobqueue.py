"""A study on workers that dask-jobqueue asks SLURM for. Run on a login node: python jobqueue.py study.toml results

Needs `pip install 'rendulic[cluster]' dask-jobqueue`. Every worker is a job of its own, with one thread; the folder must be
on a file system that all nodes share.
"""

from __future__ import annotations

import sys

from dask_jobqueue import SLURMCluster

from rendulic.figures.of_study import draw_study
from rendulic.study.execution.campaign import run_study
from rendulic.study.execution.cluster import ClusterWorkers
from rendulic.study.language.study_file import read_study

if __name__ == "__main__":
    file, folder = sys.argv[1:]
    study = read_study(file)
    one_thread = ["export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1"]
    with SLURMCluster(
        cores=1, processes=1, memory="2GB", walltime="24:00:00", nanny=False, job_script_prologue=one_thread
    ) as cluster:
        cluster.scale(64)
        cluster.wait_for_workers(8)  # more are used as they come
        done = run_study(study, folder, executor=lambda where: ClusterWorkers(where, cluster.scheduler_address))
    draw_study(done.results, study.figures.draw)
    for unit, error in done.outcome.failed.items():
        sys.stderr.write(f"failed: {unit.label}: {error}\n")
    sys.exit(3 if done.outcome.failed else 0)
