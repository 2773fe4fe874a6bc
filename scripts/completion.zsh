#compdef tandem
# Completion of `tandem` in zsh: a file `_tandem` in a folder of $fpath. The program itself answers
# what may stand there: `tandem __complete WORD…`.
_tandem() {
  local line files=no
  local -a found
  for line in "${(@f)$("${(Q)words[1]}" __complete "${(@Q)words[2,CURRENT]}" 2> /dev/null)}"; do
    if [[ $line == :files ]]; then
      files=yes
    elif [[ -n $line ]]; then
      found+=("${${line%%$'\t'*}//:/\\:}:${${line#*$'\t'}#${line}}")
    fi
  done
  (( $#found )) && _describe 'tandem' found
  [[ $files == no ]] || _files
}
_tandem "$@"
