#!/usr/bin/env bash
# Estimated errors against true ones, and accuracies asked against those reached, on some ninety scenes.
#
# usage: pipelines/estimates.sh [-o FOLDER] [--only WORD] [--grading scene]     (FOLDER defaults to estimates; scenes whose name has
# WORD, or drawn:FIRST:COUNT, those of estimates/drawn.py; with graded cells)
set -euo pipefail
. "$(dirname "$0")/common.sh"
bench_scenes estimates "$@"
