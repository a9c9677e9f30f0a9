# Completion of hextools' commands for bash. Everything it offers is what a command itself says to --help, asked once for
# each command and shell; segments are those that `info` finds in the files named so far. Where it knows nothing better
# the shell completes names of files.

declare -gA _hextools_helps=()

# _hextools_ask COMMAND...: what the command says, within two seconds, and nothing if it fails.
_hextools_ask() { timeout 2 "$@" </dev/null 2>/dev/null; }

# _hextools_learn TOOL [SUBCOMMAND]: sets `help` to what --help says.
_hextools_learn() {
  local key="$*"
  [[ ${_hextools_helps[$key]-} ]] || _hextools_helps[$key]=$(_hextools_ask "$@" --help)
  help=${_hextools_helps[$key]}
}

# _hextools_section TITLE <help: the entries of a section, without what their texts continue.
_hextools_section() { sed -n "/^$1:\$/,/^\$/s/^  \([^ ]\)/\1/p"; }

# _hextools_options <help: the names of all options.
_hextools_options() { sed -nE 's/^  (-[^ ]+).*/\1/p' | tr , '\n'; }

# _hextools_entry OPTION <help: its line.
_hextools_entry() { grep -m1 -E "^  ([^ ]+,)?$1(,[^ ]+)?( |\$)"; }

# _hextools_choices <entries: the words that the first of them may be, if it says {so,or,so}.
_hextools_choices() { sed -nE '1s/^[^{ ]* ?[^ ]+ ?[A-Z]+:\{([^}]*)\}.*/\1/p' | tr , '\n'; }

# _hextools_segments WORD...: the segments in those words that are files.
_hextools_segments() {
  local file tool
  for file; do
    [[ -f $file ]] || continue
    tool=hexscan
    [[ $file != *.hexmesh ]] || tool=hexmesh
    _hextools_ask "$folder$tool" info "$file" | sed -nE "s/^ *segment [0-9]+ '(.*)': .*/\1/p"
  done
}

# _hextools_offer: those of the lines of standard input that begin with what is typed, quoted where a shell needs it.
_hextools_offer() {
  local line
  while IFS= read -r line; do
    [[ $line != "$current"* ]] || COMPREPLY+=("$(printf %q "$line")")
  done
}

_hextools() {
  COMPREPLY=()
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} help
  if [[ $current == = ]]; then  # --option=
    current=
  elif [[ $previous == = ]]; then
    previous=${COMP_WORDS[COMP_CWORD - 2]}
  fi
  local tool=${COMP_WORDS[0]/#\~\//"$HOME"/}
  local folder=${tool%"${tool##*/}"}
  type -P -- "$tool" >/dev/null || return 0
  _hextools_learn "$tool"

  # The subcommand, if one was named: only it and the common options count then.
  local subcommands word subcommand=
  subcommands=$(_hextools_section Subcommands <<<"$help" | cut -d' ' -f1)
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    if [[ $word != -* ]] && grep -qxF -- "$word" <<<"$subcommands"; then subcommand=$word && break; fi
  done
  if [[ $subcommand ]]; then
    local common
    common=$(_hextools_section Common <<<"$help" | sed 's/^/  /')
    _hextools_learn "$tool" "$subcommand"
    help+=$'\n'$common
  fi

  if [[ $previous == -?* ]]; then
    local entry
    entry=$(_hextools_entry "$previous" <<<"$help")
    case $previous in
      --segment | --priority | --highlight | --material | --show)
        _hextools_offer < <(_hextools_segments "${COMP_WORDS[@]:1}" | sort -u)
        return 0
        ;;
    esac
    if [[ $entry =~ ^\ \ [^\ ]+\ (TEXT|INT|FLOAT|UINT|\[) ]]; then  # the option's value
      _hextools_offer < <(_hextools_choices <<<"${entry#  }")
      return 0
    fi
  fi
  if [[ $current == -* ]]; then
    _hextools_offer < <(_hextools_options <<<"$help" | sort -u)
  elif [[ $subcommand || ! $subcommands ]]; then
    _hextools_offer < <(_hextools_section Positionals <<<"$help" | _hextools_choices)
  else
    _hextools_offer <<<"$subcommands"
    # A tool that takes files as well as subcommands.
    if [[ $help == *$'\nPositionals:\n'* ]]; then
      mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY < <(compgen -f -- "$current")
      compopt -o filenames 2>/dev/null
    fi
  fi
  return 0
}

complete -o default -F _hextools hexscan hexmesh hexsolve hexsolve-mpi hexfit hexexport hexslice hexview hexbench
