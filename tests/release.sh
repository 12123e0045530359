#!/usr/bin/env bash
# The trace hashes of the release build are those that the tests hold the debug build to, on one thread,
# on all of them, and with every triangle drawn.
set -eu
cd "$(dirname "$0")/.."
# With a bench, as the one that counts instructions is built: alone, the binary has dependencies with fewer
# features, and they are compiled anew.
cargo build --release --locked --bin plainsight --bench instructions
binary="${CARGO_TARGET_DIR:-target}/release/plainsight"
snapshot=tests/it/snapshots/it__determinism__hashes_are_the_same_in_every_profile.snap
compared=0
while read -r scene hash; do
  leaf=256
  if [ "$scene" = powerplant ]; then leaf=4096; fi
  for threads in 1 0; do
    for more in "" --every-triangle; do
      row=$(RAYON_NUM_THREADS=$threads "$binary" run --scene "$scene" --seed 5 --scale 0.02 \
        --frames 4 --viewport 321x243 --leaf $leaf --culler full --oracle sim --json $more)
      case "$row" in
        *"\"trace_hash\":\"$hash\""*) compared=$((compared + 1)) ;;
        *)
          echo "tests/release.sh: $scene leaves another trace in release ($threads threads, $more): $row, not $hash" >&2
          exit 1
          ;;
      esac
    done
  done
done < <(sed -n 's/^\([a-z]*\) \([0-9a-f]\{16\}\)$/\1 \2/p' "$snapshot")
# A snapshot that cannot be read compares nothing.
[ "$compared" -ge 20 ] || { echo "tests/release.sh: only $compared hashes were compared" >&2; exit 1; }
echo "tests/release.sh: $compared traces equal those of the debug build"
