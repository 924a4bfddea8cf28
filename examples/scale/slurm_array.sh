#!/bin/bash
# A dataset as a Slurm job array into a folder that all nodes share: one share for each task, as many workers as it has processors.
#
#   sbatch examples/scale/slurm_array.sh /shared/rooms 100000
#
# A task that is preempted or whose node fails goes back into the queue and makes what is missing of its share; the last one writes the
# manifest and the card.  `sbatch --array=0-199 ...` takes another number of tasks; it must be the same until the dataset is complete.
#SBATCH --job-name=scene_synth
#SBATCH --array=0-99
#SBATCH --nodes=1
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=32
#SBATCH --mem-per-cpu=1500M
#SBATCH --time=24:00:00
#SBATCH --requeue
#SBATCH --open-mode=append
set -eu
export NUMBA_CACHE_DIR="${NUMBA_CACHE_DIR:-$1.kernels}"  # compiled once for all nodes of a kind

# since Slurm 22.05 srun does not take --cpus-per-task from the job
exec srun --cpus-per-task="$SLURM_CPUS_PER_TASK" scene_synth generate --params ground_truth --rooms "$2" --seed 1 --out "$1" \
    --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" --workers "$SLURM_CPUS_PER_TASK"
