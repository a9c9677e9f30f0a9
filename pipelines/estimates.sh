#!/usr/bin/env bash
# Estimated errors against true ones, and accuracies asked against those reached, on some seventy scenes.
#
# usage: pipelines/estimates.sh [-o FOLDER] [--only WORD] [--grading scene]     (FOLDER defaults to estimates; scenes whose name has
# WORD; with graded cells)
set -euo pipefail
. "$(dirname "$0")/common.sh"
bench_scenes estimates "$@"
