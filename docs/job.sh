#!/bin/bash
#SBATCH --job-name=mpm_dem
#SBATCH --nodes=1
#SBATCH --ntasks=8              # ranks
#SBATCH --cpus-per-task=1
#SBATCH --time=24:00:00         # of one job: the run goes on in the next
#SBATCH --signal=USR1@300       # so many seconds before, the ranks are told to write a checkpoint and to end
#SBATCH --requeue               # after the last line of this script, or when a node has failed
#SBATCH --open-mode=append      # of the output, when the job comes back
#SBATCH --output=%x-%j.txt
#
# Runs a case to its end, in as many jobs of Slurm as that takes; see docs/cluster.md. In the folder of the project:
#
#     sbatch docs/job.sh out/beam cases/beam_impact.py t_end=0.01 -mpm_snes_monitor
#
# The first word is the folder of the results. With IMAGE=mpm_dem.sif before it, the project is that in the container.
set -u
export OMP_NUM_THREADS=1

out=$(realpath -m "${1:?give the folder of the results, the case, and its keys}")
shift
if [[ -n ${IMAGE:-} ]]; then
    project=(apptainer run "$IMAGE")
else
    project=(./dev run)
    ./dev setup || exit  # once, not by all ranks
fi

restart=()
if compgen -G "$out/checkpoint*.h5" >/dev/null; then
    restart=("restart=$out")
fi
srun --mpi=pmix --cpu-bind=cores "${project[@]}" python "$@" "out=$out" checkpoint=10min "${restart[@]}"
status=$?

if (( status )); then
    echo "job.sh: the run has failed, look above for the reason" >&2
    exit $status
elif [[ $(sed -n 's/^state: //p' "$out/manifest.txt" | tail -n 1) == complete ]]; then
    echo "job.sh: the run is complete"
else
    echo "job.sh: the run goes on in the next job"
    scontrol requeue "$SLURM_JOB_ID"
fi
