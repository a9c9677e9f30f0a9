# Sourced by the pipelines: finds the tools.
tools=${HEXTOOLS_BIN:-$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)/build/bin}
[ -x "$tools/hexsolve" ] || { echo "no tools in $tools, expected them from ./run build" >&2; exit 1; }
PATH=$tools:$PATH

# A name that begins with - as the tools and other commands take it for a file; - alone stays standard input.
file_name() { case $1 in -?*) printf './%s' "$1" ;; *) printf '%s' "$1" ;; esac; }

# A bench of scenes: measures those of pipelines/NAME whose name has a word, makes the table of what was found.
#
# usage: bench_scenes NAME [-o FOLDER] [--only WORD] [--grading scene]     (FOLDER defaults to NAME)
bench_scenes() {
  local here name=$1 folder=$1 only= grading=
  here=$(cd "$(dirname "${BASH_SOURCE[0]}")/$name" && pwd)
  shift
  while [ $# -gt 0 ]; do
    case "$1" in
      -o) folder=$(file_name "${2:?-o needs a folder}"); shift 2 ;;
      --only) only=${2:?--only needs a word}; shift 2 ;;
      --grading) grading=${2:?--grading needs a word}; shift 2 ;;
      *) echo "unknown option '$1', expected -o FOLDER or --only WORD" >&2; exit 2 ;;
    esac
  done
  local python=python3
  case $only in drawn:*) . "$here/../python.sh" ;; esac  # which has numpy too
  mkdir -p "$folder"
  "$python" "$here/measure.py" "$folder" "$only" ${grading:+"$grading"} >"$folder/scenes.jsonl"
  python3 "$here/table.py" "$folder/scenes.jsonl" >"$folder/table.md"
  cat "$folder/table.md"
  echo "the table and all numbers are in $folder" >&2
}
