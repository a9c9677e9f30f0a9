# Sourced by the pipelines: finds the tools and reads numbers out of their reports.
tools=${HEXTOOLS_BIN:-$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)/build/bin}
[ -x "$tools/hexsolve" ] || { echo "no tools in $tools, expected them from ./run build" >&2; exit 1; }
PATH=$tools:$PATH

# report FILE KEY...: the value under a path of keys in a JSON report
report() {
  python3 -c 'import json, sys
value = json.load(open(sys.argv[1]))
for key in sys.argv[2:]:
    value = value[int(key)] if isinstance(value, list) else value[key]
print(value)' "$@"
}
