#!/usr/bin/env bash
# What hexsolve --plan expects of time and memory, against what the solutions take. On a machine with nothing else to do.
#
# usage: pipelines/plans.sh [-o FOLDER] [--only WORD]     (FOLDER defaults to plans; scenes whose name has WORD)
set -euo pipefail
. "$(dirname "$0")/common.sh"
bench_scenes plans "$@"
