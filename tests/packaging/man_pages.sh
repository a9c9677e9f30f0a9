#!/usr/bin/env bash
# man_pages.sh PYTHON BIN: the manual pages of the tools in the folder BIN name every option, and man warns of nothing.
set -euo pipefail
python=$1 bin=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
options() { grep -oE '^  -[^ ]+' | tr -d ' ' | tr , '\n' | sort -u; }

for tool in hexscan hexmesh hexsolve hexsolve-mpi hexfit hexexport hexslice hexview hexbench; do
  [ -x "$bin/$tool" ] || continue
  page=$folder/$tool.1
  "$python" "$(dirname "$0")/../../packaging/man_page.py" "$bin/$tool" 1.2.3 2026-01-31 >"$page"
  plain=$(sed 's/\\-/-/g; s/\\f.//g' "$page")
  { "$bin/$tool" --help
    for subcommand in $("$bin/$tool" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z]*\) .*/\1/p'); do
      "$bin/$tool" "$subcommand" --help
    done; } | options | while read -r option; do
    grep -qE -- "(^|, )$option(,| |\$)" <<<"$plain" || { echo "$tool.1 does not name $option"; exit 1; }
  done
  if command -v man >/dev/null && command -v groff >/dev/null; then
    warnings=$(man --warnings -E UTF-8 -l -Tutf8 -Z "$page" 2>&1 >/dev/null)
    [ -z "$warnings" ] || { echo "$tool.1: $warnings"; exit 1; }
  fi
done
