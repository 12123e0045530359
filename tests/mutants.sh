#!/usr/bin/env bash
# Mutates the way from a failure to the exit code, one small edit at a time, and runs one quick group of tests
# (gate::, see tests/it/gate.rs) against each: an edit that no test notices must stand in tests/mutants.txt,
# with the reason why it does no harm. Wants cargo-mutants (cargo install cargo-mutants --locked) and takes
# hours; it is no part of CI.
#
#   tests/mutants.sh              every shard, one after the other
#   tests/mutants.sh 3 7          these shards
#   tests/mutants.sh --list       the edits
#
# SHARDS (32) is into how many shards the edits are cut, RESULTS (target/mutants) the folder of what they came
# to. A shard whose result is there is not run again: stop at any time, and start again to go on.
set -eu
cd "$(dirname "$0")/.."
shards="${SHARDS:-32}"
results="${RESULTS:-target/mutants}"
# Seconds for the group against one edit: several times what it takes without any.
limit=240
files=()
for file in 'src/check/*.rs' src/run/stop.rs src/run/told.rs src/stress/world.rs src/stress/tally.rs \
  src/fault/trial.rs src/accuracy/measure.rs src/report/row.rs src/report/junit.rs src/cli/tell.rs \
  src/cli/run.rs src/cli/plan.rs src/cli/repeat.rs src/cli/watchdog.rs src/cli/pipe.rs src/cli/mod.rs; do
  files+=(--file "$file")
done
if [ "${1:-}" = --list ]; then
  exec cargo mutants --list "${files[@]}"
fi
command -v cargo-mutants >/dev/null || {
  echo "tests/mutants.sh: no cargo-mutants; cargo install cargo-mutants --locked" >&2
  exit 2
}
wanted=("$@")
if [ $# -eq 0 ]; then
  mapfile -t wanted < <(seq 0 $((shards - 1)))
fi
mkdir -p "$results"
for shard in "${wanted[@]}"; do
  into="$results/$shard-of-$shards"
  if [ -e "$into/done" ]; then
    continue
  fi
  rm -rf "$into"
  mkdir -p "$into"
  # 0: all noticed; 2: some not; 3: some ran out of time, which is noticed too. Whatever else is no result.
  code=0
  cargo mutants --shard "$shard/$shards" --output "$into" --timeout "$limit" --no-times --colors never \
    "${files[@]}" -- --locked --test it gate:: || code=$?
  case $code in
    0 | 2 | 3) touch "$into/done" ;;
    *)
      echo "tests/mutants.sh: shard $shard of $shards came to no result (exit code $code)" >&2
      exit 2
      ;;
  esac
done
# An edit is known by its file and its words: lines move.
words() { sed -E 's/^([^:]+):[0-9]+:[0-9]+: /\1: /' "$@" | sort -u; }
argued=$(sed -E '/^(#|$)/d; s/ +# .*$//' tests/mutants.txt | sort -u)
unargued=$(comm -23 <(cat "$results"/*-of-"$shards"/mutants.out/missed.txt | words) <(echo "$argued"))
finished=$(ls "$results"/*-of-"$shards"/done | wc -l)
noticed=$(cat "$results"/*-of-"$shards"/mutants.out/{caught,timeout}.txt | wc -l)
missed=$(cat "$results"/*-of-"$shards"/mutants.out/missed.txt | wc -l)
echo "tests/mutants.sh: $finished of $shards shards; $noticed edits noticed, $missed not"
if [ -n "$unargued" ]; then
  echo "not noticed, and not argued in tests/mutants.txt:"
  echo "$unargued"
  exit 1
fi
