#!/usr/bin/env bash
# An archive as a Slurm array: every task scans one shard, a last job merges the tables.
#
#   examples/archives/slurm.sh MANIFEST STATION OUT [SHARDS [OPTIONS OF BATCH...]]
#
# To find a part: ... 64 --recipe /archive/led.toml. MANIFEST, STATION, OUT and the recipe lie on a disk that all nodes
# see. A task that is lost is queued again. Recordings with results are not scanned again.
set -eu
manifest=$(realpath "$1") station=$(realpath "$2") out=$(realpath -m "$3") shards=${4:-64}
shift $(($# < 4 ? $# : 4))
# Refuses what is wrong with the manifest, the station or the folder before anything is queued.
sheetlight batch "$manifest" --station "$station" --out "$out" "$@" --plan
options=""
[ $# = 0 ] || options=$(printf ' %q' "$@")
task="sheetlight batch '$manifest' --station '$station' --out '$out' --shard \$SLURM_ARRAY_TASK_ID/$shards$options"
array=$(sbatch --parsable --requeue --array="1-$shards" --job-name=sheetlight --wrap="$task")
sbatch --dependency="afterany:$array" --job-name=sheetlight-merge --wrap="sheetlight batch merge '$out'"
