"""Cases of `routes run` as jobs of SLURM: python examples/cluster/slurm.py --problem 'bar[n=8|64]' --route all

Needs dask-jobqueue; the folder it is started from, and Python's, are to be seen by all hosts.
"""

import subprocess
import sys

from dask_jobqueue import SLURMCluster


def cluster():
    """For PBS: PBSCluster, with resource_spec="select=1:ncpus=2:mem=8GB" in place of what is SLURM's."""
    return SLURMCluster(
        queue="normal",
        cores=2,
        processes=1,  # of a job: one worker, one case at a time
        memory="8GB",
        walltime="04:00:00",
        job_extra_directives=["--exclusive"],  # nobody else on the host while cases are timed
        python=sys.executable,
        scheduler_options={"dashboard_address": ":0"},  # any free port
        n_workers=0,
    )


def main():
    """A scheduler here, up to ten jobs that are its workers, one sweep."""
    with cluster() as workers:
        workers.adapt(maximum_jobs=10)
        address = workers.scheduler_address
        sweep = ["routes", "run", "--executor", "dask", "--scheduler", address, *sys.argv[1:]]
        return subprocess.call(sweep)


if __name__ == "__main__":
    sys.exit(main())
