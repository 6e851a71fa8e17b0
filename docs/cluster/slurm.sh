#!/usr/bin/env bash
# Renders $SCENE with $SPP samples per pixel as an array of N shards under Slurm, and merges them.
#   SCENE=room.toml SPP=1024 ./slurm.sh N [FLAG...]
# A job that is requeued continues its film. It prints the numbers of the array and of the merge.
set -euo pipefail
count=${1:?usage: SCENE=room.toml SPP=1024 $0 N [FLAG...]}
shift
: "${SCENE:?names the scene}" "${SPP:?is the number of samples per pixel}"
halflight=${HALFLIGHT:-halflight}
output=${OUTPUT:-picture.exr}
films=${FILMS:-films}
mkdir -p "$films"
flags=$(printf '%q ' "$@")
array=$(sbatch --parsable --requeue --array="1-$count" --job-name=halflight --output="$films/%a.log" --wrap "
    exec $(printf '%q' "$halflight") render $(printf '%q' "$SCENE") --spp $SPP $flags \
        --shard \$SLURM_ARRAY_TASK_ID/$count --continue $(printf '%q' "$films")/\$SLURM_ARRAY_TASK_ID.film")
echo "$array"
sbatch --parsable --dependency="afterok:$array" --job-name=halflight-merge --output="$films/merge.log" --wrap "
    exec $(printf '%q' "$halflight") merge $(printf '%q' "$films")/*.film -o $(printf '%q' "$output")"
