#!/usr/bin/env bash
# One task of an array: its share of a manifest's items. submit.sh hands it in.
#SBATCH --requeue
#SBATCH --open-mode=append
manifest=$1 tasks=$2
most=3 # times that a task may be run again

# A warning before the end, at which the bake ends by itself, must not end this shell before it.
trap : TERM
echo "share $SLURM_ARRAY_TASK_ID of $tasks on $SLURMD_NODENAME, restarts: ${SLURM_RESTART_COUNT:-0}"
"${BLENDER:-blender}" --background --command occlusion_bake --manifest "$manifest" \
  --items "$SLURM_ARRAY_TASK_ID/$tasks" --threads "${SLURM_CPUS_PER_TASK:-0}"
status=$?
if ((status == 137 && ${SLURM_RESTART_COUNT:-0} < most)); then # it was killed, as for want of memory
  scontrol requeue "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID"
fi
exit "$status"
