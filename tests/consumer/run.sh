#!/usr/bin/env bash
# run.sh CMAKE CXX BUILD FOLDER few|all: installs the build, builds this project against it, runs it, looks into the
# headers, of which `few` reads one of eight.
set -euo pipefail
cmake=$1 cxx=$2 build=$3 folder=$4 form=$5
rm -rf "$folder"
mkdir -p "$folder"
"$cmake" --install "$build" --prefix "$folder/prefix" >"$folder/install.log"
"$cmake" -G Ninja -S "$(dirname "$0")" -B "$folder/build" -DCMAKE_CXX_COMPILER="$cxx" -DFORM="$form" \
  -DCMAKE_CXX_COMPILER_LAUNCHER="$(command -v ccache || true)" -DCMAKE_PREFIX_PATH="$folder/prefix" >"$folder/configure.log"
"$cmake" --build "$folder/build"
(cd "$folder" && build/consumer)

# What is behind the public headers stays there: register layouts, rooms without a public header, paths of this machine.
if grep -rnE '__m(128|256|512)|immintrin|vector_size|omp simd|\bbatch|\blanes' "$folder/prefix/include"; then
  echo 'installed headers name register layouts' >&2
  exit 1
fi
if find "$folder/prefix" -path '*include/hexsolver/*' -type d |
  grep -vE '/(core|scene|report|equilibrium|dynamics|plan)$'; then
  echo 'installed are rooms that have no public header' >&2
  exit 1
fi
if grep -rnF "$(cd "$build" && pwd)" "$folder/prefix/lib" --include='*.cmake'; then
  echo 'what is installed refers to the build' >&2
  exit 1
fi
