#!/usr/bin/env bash
# run_fuzzers.sh BUILD SECONDS JOBS: runs every libFuzzer driver of BUILD for SECONDS, JOBS at a time. Starts from the corpus of
# tests/hostile, new seeds and the inputs of earlier runs. Fails if a driver finds something.
set -euo pipefail
build=$(realpath "$1") seconds=$2 jobs=$3
here=$(cd "$(dirname "$0")" && pwd)
kept=$(realpath "$here/../hostile/corpus")
work=$build/fuzzing
drivers=(bundle_reader mesh_reader scene tools)

mkdir -p "$work/findings"
"$build/tests/write_seeds" "$work/seeds"

fuzz() {
  local name=$1
  mkdir -p "$work/corpus/$name" "$work/seeds/$name"
  "$build/tests/fuzz_$name" -max_total_time="$seconds" -timeout=25 -rss_limit_mb=2048 -max_len=150000 -print_final_stats=1 \
      -artifact_prefix="$work/findings/$name-" "$work/corpus/$name" "$kept/$name" "$work/seeds/$name" > "$work/$name.log" 2>&1
}
export -f fuzz
export build seconds kept work
failed=0
printf '%s\n' "${drivers[@]}" | xargs -P "$jobs" -I{} bash -c 'fuzz {} || { echo "fuzz_{} found something: see '"$work"'/{}.log" >&2; exit 1; }' || failed=1

for name in "${drivers[@]}"; do
  executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$work/$name.log" | tail -1)
  covered=$(sed -n 's/.* cov: \([0-9]*\) .*/\1/p' "$work/$name.log" | tail -1)
  echo "fuzz_$name: ${executions:-?} executions, ${covered:-?} edges covered"
done
[ "$failed" -eq 0 ] && exit 0
echo >&2
for finding in "$work"/findings/*; do
  name=$(basename "$finding"); name=${name%%-*}
  echo "finding:  $finding" >&2
  echo "  replay:   $build/tests/fuzz_$name $finding" >&2
  echo "  minimise: $build/tests/fuzz_$name -minimize_crash=1 -runs=10000 $finding" >&2
  echo "  keep:     cp $finding $kept/$name/   (ctest -R HostileCorpus then replays it)" >&2
done
exit 1
