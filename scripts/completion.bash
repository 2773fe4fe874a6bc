# Completion of `tandem` in bash: `source scripts/completion.bash`. The program itself answers what
# may stand there: `tandem __complete WORD…`.
_tandem() {
  local word words=() line found=() files=no
  for word in "${COMP_WORDS[@]:1:COMP_CWORD}"; do
    [ "$word" = = ] || words+=("$word")  # bash takes --hal=sim for three words
  done
  [ "${COMP_WORDS[COMP_CWORD]}" != = ] || words+=('')
  while IFS= read -r line; do
    if [ "$line" = :files ]; then files=yes; else found+=("${line%%$'\t'*}"); fi
  done < <("${COMP_WORDS[0]/#\~/$HOME}" __complete "${words[@]}" 2> /dev/null)
  if [ $files = yes ]; then
    compopt -o filenames 2> /dev/null  # outside of a completion there is none to tell
    while IFS= read -r line; do found+=("$line"); done < <(compgen -f -- "${words[-1]}")
  fi
  COMPREPLY=(${found[@]+"${found[@]}"})
}
complete -F _tandem tandem
