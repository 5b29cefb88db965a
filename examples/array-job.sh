#!/usr/bin/env bash
# One task of a Slurm array job: renders its share of the samples to parts/K.exr, for `tyndall merge parts/*.exr`.
#   sbatch examples/array-job.sh SCENE SAMPLES [OPTION]...
#SBATCH --array=1-4
#SBATCH --cpus-per-task=8
set -euo pipefail
scene=$1
samples=$2
shift 2
# Number of parts: the size of the array, also when one task alone is submitted again. For 8 parts: TYNDALL_PARTS=8 sbatch --array=1-8 ...
parts=${TYNDALL_PARTS:-4}
mkdir -p parts
tyndall render "$scene" --samples "$samples" --part "$SLURM_ARRAY_TASK_ID/$parts" -q -o "parts/$SLURM_ARRAY_TASK_ID.exr" "$@"
