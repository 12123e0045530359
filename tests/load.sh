#!/usr/bin/env bash
# Whether the real device answers the same questions alike on a loaded machine: runs the plant N times (20 by
# default) with four busy loops beside it, prints a line for each run that does not repeat and exits 1 if
# any does not. Its own command, not part of CI: a run takes ten seconds and more.
#
#   tests/load.sh [N]
#   PLAINSIGHT_BINARY=older/plainsight tests/load.sh 20    # another build; else the release build, made first
set -eu
cd "$(dirname "$0")/.."
runs="${1:-20}"
case "$runs" in
  '' | *[!0-9]* | 0) echo "tests/load.sh: '$runs' is no number of runs; say 1 or more" >&2; exit 2 ;;
esac
binary="${PLAINSIGHT_BINARY:-}"
if [ -z "$binary" ]; then
  cargo build --release --locked --bin plainsight
  binary="${CARGO_TARGET_DIR:-target}/release/plainsight"
fi
[ -x "$binary" ] || { echo "tests/load.sh: '$binary' is no program; name one by PLAINSIGHT_BINARY" >&2; exit 2; }
# Mesa complains on standard error without one.
if [ -z "${XDG_RUNTIME_DIR:-}" ]; then export XDG_RUNTIME_DIR=/tmp; fi

out=$(mktemp -d)
loops=()
finish() {
  [ "${#loops[@]}" -eq 0 ] || kill "${loops[@]}" 2>/dev/null || true
  rm -rf "$out"
}
trap finish EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
for _ in 1 2 3 4; do
  (while :; do :; done) &
  loops+=($!)
done

failed=0
for run in $(seq 1 "$runs"); do
  code=0
  # In the background: a signal is then handled at once, not when the run has ended.
  "$binary" compare --scene powerplant --scale 1 --oracle hardware --culler full --frames 8 --rounds 9 \
    --out "$out/figures" >"$out/said" 2>&1 &
  loops+=($!)
  wait "$!" || code=$?
  unset 'loops[-1]'
  if [ "$code" -eq 0 ]; then
    echo "run $run: repeated"
  else
    failed=$((failed + 1))
    why=$(grep -m1 -E 'determinism|not repeatable|error' "$out/said" || tail -n1 "$out/said")
    echo "run $run: exit code $code: $why"
  fi
done
echo "load: $failed of $runs runs did not repeat"
[ "$failed" -eq 0 ]
