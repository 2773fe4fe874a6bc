#!/bin/sh
# Runs every fuzz target for a while: tests/fuzz/run.sh [SECONDS] [BUILD_FOLDER]
# Build first: cmake --preset fuzz && cmake --build --preset fuzz
# Exit status: 0 nothing found; 1 a crash, whose input is left in BUILD_FOLDER/fuzz.
set -eu
seconds=${1:-60}
root=$(cd "$(dirname "$0")/../.." && pwd)
build=${2:-$root/build/fuzz}
export UBSAN_OPTIONS="halt_on_error=1:print_stacktrace=1" ASAN_OPTIONS="detect_leaks=1"

for target in urdf robot experiment; do
  program=$build/bin/fuzz_$target
  if [ ! -x "$program" ]; then
    echo "$program is missing: cmake --preset fuzz && cmake --build --preset fuzz" >&2
    exit 1
  fi
  corpus=$build/fuzz/$target
  mkdir -p "$corpus"
  cp "$root/tests/fuzz/seeds/$target"/* "$corpus"
  for file in "$root"/config/*/*; do
    case $target:$file in
      urdf:*.urdf | robot:*/robot.toml) cp "$file" "$corpus/$(echo "$file" | cksum | cut -d' ' -f1)" ;;
      *:*/robot.toml) ;;
      experiment:*.toml) cp "$file" "$corpus/$(echo "$file" | cksum | cut -d' ' -f1)" ;;
    esac
  done
  echo "== $target: $seconds s"
  "$program" -max_total_time="$seconds" -max_len=16384 -timeout=10 -rss_limit_mb=2048 \
    -verbosity=0 -print_funcs=0 -dict="$root/tests/fuzz/$target.dict" \
    -artifact_prefix="$build/fuzz/$target-" "$corpus"
done
echo "nothing found"
