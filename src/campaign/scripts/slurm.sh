#!/bin/bash
# sbatch this file. The cases of a job that was killed are taken over: submit it again.
#SBATCH --job-name=misclosure
#SBATCH --array=1-@SHARDS@
#SBATCH --cpus-per-task=@JOBS@

misclosure campaign run @FOLDER@ --shard "$SLURM_ARRAY_TASK_ID"/@SHARDS@ --jobs @JOBS@
