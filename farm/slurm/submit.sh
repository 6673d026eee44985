#!/usr/bin/env bash
# submit.sh MANIFEST TASKS [OPTION…]: bake what was planned as an array of Slurm's, then merge. The options are sbatch's;
# BLENDER is a Blender in which the extension is installed, as the nodes have it (blender). docs/farm.md tells the rest.
set -euo pipefail
(($# >= 2)) || { sed -n 's/^# //p' "$0" >&2; exit 2; }
here=$(cd "$(dirname "$0")" && pwd)
manifest=$(realpath -e -- "$1") tasks=$2
shift 2

bake=$(sbatch --job-name=bake "$@" --parsable --array="1-$tasks" "$here/bake.sh" "$manifest" "$tasks")
echo "bake: job ${bake%%;*}, $tasks tasks"
merge=$(sbatch --job-name=merge "$@" --parsable --dependency="afterany:${bake%%;*}" "$here/merge.sh" "$manifest")
echo "merge: job ${merge%%;*}"
