# Completion of `tandem` in bash: `source scripts/completion.bash`. Commands and flags are what
# `tandem … --help` lists.
_tandem() {
  local word words=()
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [[ $word == -* ]] && break
    words+=("$word")
  done
  local known
  known=$("${COMP_WORDS[0]}" "${words[@]}" --help 2>/dev/null | awk '
    /^[A-Z].*:$/ { part = /^Subcommands|`tandem help/ ? "Subcommands:" : $1 }
    part == "Subcommands:" && /^  [a-z]/ { print $1 }
    part == "Options:" && /^  -/ { sub(/^.*--/, "--", $1); print $1 }')
  mapfile -t COMPREPLY < <(compgen -W "$known" -- "${COMP_WORDS[COMP_CWORD]}")
}
complete -o default -F _tandem tandem
