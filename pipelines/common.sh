# Sourced by the pipelines: finds the tools.
tools=${HEXTOOLS_BIN:-$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)/build/bin}
[ -x "$tools/hexsolve" ] || { echo "no tools in $tools, expected them from ./run build" >&2; exit 1; }
PATH=$tools:$PATH
