#!/usr/bin/env bash
# completion.sh BIN: what bash would offer, for the tools in the folder BIN.
set -uo pipefail
. "$(dirname "$0")/../../packaging/completion.bash"
PATH=$1:$PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
hexscan -q phantom liver --spacing 8 -o scan.nrrd
hexmesh -q build scan.nrrd -o scan.hexmesh
failures=0

# offers WANTED... -- WORD...: all that is wanted is among what is offered for the last word, and nothing is said.
# A word that begins with ! must not be.
offers() {
  local wanted=() said offered word
  while [ "$1" != -- ]; do wanted+=("$1"); shift; done
  shift
  COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
  said=$(_hextools 2>&1)  # errors would stand on the user's command line
  _hextools
  offered=$(printf '%s\n' "${COMPREPLY[@]}")
  for word in "${wanted[@]}"; do
    if [ "${word#!}" = "$word" ]; then
      grep -qxF -- "$word" <<<"$offered" && continue
    else
      grep -qxF -- "${word#!}" <<<"$offered" || continue
    fi
    printf 'FAILED: %s offers {%s}, expected %s\n' "$*" "${offered//$'\n'/ }" "$word"
    failures=$((failures + 1))
  done
  [ -z "$said" ] || { printf 'FAILED: %s says: %s\n' "$*" "$said"; failures=$((failures + 1)); }
}

for tool in hexscan hexmesh hexsolve hexfit hexexport hexslice hexview hexbench; do
  offers --help --version --quiet -q --threads -- "$tool" -
  offers never always auto -- "$tool" --progress ''
  offers auto always '!never' -- "$tool" --progress = a
done
offers build info check surface '!--help' -- hexmesh ''
offers --material --quiet --output '!--json' -- hexmesh build --
offers build '!info' -- hexmesh --force b
offers phantom scan.nrrd scan.hexmesh -- hexscan ''
offers scan.nrrd '!phantom' -- hexscan s
offers liver c-shape torsion-bar -- hexscan phantom ''
offers cylinder c-shape '!liver' -- hexscan phantom c
offers axial sagittal -- hexslice planes scan.hexresult --axis ''
offers --scan --report '!--largest-component' -- hexexport --
offers liver tumour vessel -- hexscan scan.nrrd --segment ''
offers tumour '!liver' -- hexscan scan.nrrd --segment t
offers tumour '!liver' -- hexscan scan.nrrd --segment = t
offers vessel '!liver' -- hexmesh surface scan.hexmesh --segment v
offers '!liver' -- hexscan nothing.nrrd --segment ''
offers '!--help' -- hexsolve scan.hexmesh ''
offers --level '!--help' -- hexsolve --l

# A tool that hangs or fails is given up, silently.
mkdir bad
printf '#!/bin/sh\nsleep 60\n' >bad/hexsolve
printf '#!/bin/sh\necho broken >&2\nexit 1\n' >bad/hexscan
chmod +x bad/*
began=$SECONDS
offers '!--help' -- bad/hexsolve -
offers '!--help' -- bad/hexscan -
offers '!--help' -- none/hexscan -
[ $((SECONDS - began)) -lt 20 ] || { echo 'FAILED: a tool that hangs is waited for'; failures=$((failures + 1)); }
[ "$failures" -eq 0 ] || exit 1
echo 'all as expected'
