# Sourced by the pipelines: finds the tools.
tools=${HEXTOOLS_BIN:-$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)/build/bin}
[ -x "$tools/hexsolve" ] || { echo "no tools in $tools, expected them from ./run build" >&2; exit 1; }
PATH=$tools:$PATH

# A name that begins with - as the tools and other commands take it for a file; - alone stays standard input.
file_name() { case $1 in -?*) printf './%s' "$1" ;; *) printf '%s' "$1" ;; esac; }
