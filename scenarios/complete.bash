# shellcheck shell=bash
# Completion of the scripts beside this file, from what their --help says. Sourced by setup.sh.

_complete_scenario() { # SCRIPT WORD PREVIOUS
  local folder=${1%/*} name=${1##*/} usage argument='' words=''
  folder=${folder/#\~/$HOME}
  [[ $1 == */* && -f $folder/start.bash ]] || return 1
  usage=$(python3 -S "$folder" --check "${name%.sh}" --help 2>/dev/null) || return
  if [[ $3 == --* ]]; then
    argument=$(sed -nE "s/^  $3 ([^ ]+)  .*/\1/p" <<<"$usage")
  fi
  case $argument in
    *'|'*) words=${argument//|/ } ;;
    *.yaml)
      words=$(cd "$folder/../params" && printf '%s ' *.yaml)
      mapfile -t COMPREPLY < <(compgen -d -S / -- "$2"; compgen -f -X '!*.yaml' -- "$2")
      ;;
    DIR) mapfile -t COMPREPLY < <(compgen -d -- "$2") ;;
    NAME...) words="paper default $(cd "$folder/../params/laws" && printf '%s ' *.yaml)" ;;
    ?*) ;; # a number or a name, which only who types it knows
    '')
      words=$(sed -nE 's/^  (--[a-z-]+) .*/\1/p' <<<"$usage")
      ((COMP_CWORD > 1)) || words+=" $(sed -nE 's/^  NAME +(.*)/\1/p' <<<"$usage")"
      ;;
  esac
  [[ $argument != NAME... ]] || words=${words//.yaml/}
  mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY < <(compgen -W "$words" -- "$2")
}

complete -F _complete_scenario {commission,compare,ellipse,ellipse_4dof,faults,paper_tables}.sh \
  {robustness,single_motor,steps,trajectory}.sh
