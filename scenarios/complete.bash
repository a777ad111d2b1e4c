# shellcheck shell=bash
# Completion of the scripts beside this file, from what their --help says. Sourced by setup.sh, in
# bash and, where its completion is on, in zsh.

_offer_files() { # ARGUMENTS OF COMPGEN...
  local IFS=$'\n'
  # shellcheck disable=SC2207 # a name may hold a blank, and zsh has no mapfile
  COMPREPLY+=($(compgen "$@"))
}

_complete_scenario() { # SCRIPT WORD PREVIOUS
  local folder=${1%/*} name=${1##*/} usage argument='' words=''
  folder=${folder/#\~/$HOME}
  COMPREPLY=()
  [[ $1 == */* && -f $folder/start.bash ]] || return 1
  usage=$(python3 -S "$folder" --check "${name%.sh}" --help 2>/dev/null) || return
  if [[ $3 == --* ]]; then
    argument=$(sed -nE "s/^  $3 ([^ ]+)  .*/\1/p" <<<"$usage")
  fi
  case $argument in
    *'|'*) words=${argument//[|]/ } ;;
    *.yaml)
      words=$(cd "$folder/../params" && printf '%s ' *.yaml)
      _offer_files -d -S / -- "$2"
      _offer_files -f -X '!*.yaml' -- "$2"
      ;;
    DIR) _offer_files -d -- "$2" ;;
    EXPERIMENT...) words='ellipse forces step_y step_x step_theta scan hold' ;;
    LAW | NAME...) words="paper default $(cd "$folder/../params/laws" && printf '%s ' *.yaml)" ;;
    ?*) ;; # a number or a name, which only who types it knows
    '')
      words=$(sed -nE 's/^  (--[a-z-]+) .*/\1/p' <<<"$usage")
      ((COMP_CWORD > 1)) || words+=" $(sed -nE 's/^  NAME +(.*)/\1/p' <<<"$usage")"
      ;;
  esac
  [[ $argument != NAME... && $argument != LAW ]] || words=${words//.yaml/}
  # shellcheck disable=SC2207 # words without blanks
  COMPREPLY+=($(compgen -W "$words" -- "$2"))
}

complete -F _complete_scenario {commission,compare,ellipse,ellipse_4dof,faults,paper_tables}.sh \
  {robustness,single_motor,steps,trajectory,tune}.sh
