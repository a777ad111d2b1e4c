#!/usr/bin/env bash
# Six runs, one after another, each by its own scenario; then the page. See --help.
. "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"
heed_interrupt "$@"
scenario=paper_tables out='' mode=lockstep signal_code=0 child='' failed=()
step_time='' ellipse_time=''

usage() {
  cat <<'END'
All experiments of the paper, Table III and Figs. 4 to 8, through the nodes on the benchmark plant,
with the paper's controller and with ours; then one page with the paper's own figures beside both.
Some minutes in lockstep, a quarter of an hour in real time.

usage: scenarios/paper_tables.sh [options]
  --mode lockstep|realtime  as fast as it computes and repeatable, or 1 kHz by the clock
                            (default lockstep)
  --out DIR                 where runs and page are left (default runs/paper_tables-<time>)
  --quick                   short windows: 6 s for each step, 4 s of each ellipse
  --help                    this text
END
}

take_options() { # OPTION...
  while (($#)); do
    local option=$1 value=''
    shift
    case $option in
      --help | -h) usage && exit 0 ;;
      --*=*) value=${option#*=} option=${option%%=*} ;;
      --mode | --out)
        (($#)) || refuse "$option needs a value; see --help"
        value=$1
        shift
        ;;
    esac
    case $option in
      --mode) mode=$(one_of "$option" "$value" lockstep realtime) ;;
      --out) out=$value && [[ -n $out ]] || refuse '--out needs a folder' ;;
      --quick) step_time=6.0 ellipse_time=4.0 ;;
      *) refuse "unknown option '$option'; see --help" ;;
    esac
  done
}

make_folder() {
  local name
  out=${out:-$scenario_root/runs/paper_tables-$(date +%Y%m%d-%H%M%S)}
  for name in paper ours paper_tables.html; do
    [[ ! -e $out/$name ]] || refuse "'$out' already holds runs: choose another --out"
  done
  mkdir -p -- "$out" 2>/dev/null ||
    refuse "cannot write to '$out': check its permissions and the space left, or choose another --out"
  out=$(realpath -- "$out")
}

# One scenario in a process group of its own: a Ctrl-C reaches this shell alone, which hands it on
# and waits until the scenario has cleaned up.
fly() { # CONTROLLER SCENARIO OPTION...
  local name=$1/$2 script=$scenario_root/scenarios/$2.sh bound=() code=0
  shift 2
  ((!signal_code)) || return 0
  tell "$name"
  ! command -v setpriv >/dev/null || bound=(setpriv --pdeathsig TERM)
  set -m
  "${bound[@]}" "$script" --mode "$mode" --params "$scenario_root/params/benchmark.yaml" "$@" \
    --out "$out/$name" </dev/null &
  child=$!
  set +m
  ((!signal_code)) || kill -TERM "$child" 2>/dev/null || true
  wait "$child" || code=$?
  while kill -0 "$child" 2>/dev/null; do # a signal ends wait, not the child
    wait "$child" || code=$?
  done
  child=''
  ((!code)) || failed+=("$name")
}

interrupted() { # SIGNAL CODE
  ((!signal_code)) || return 0
  signal_code=$2
  [[ -z $child ]] || kill "-$1" "$child" 2>/dev/null || true
}

fly_all() {
  local controller law params=$scenario_root/params
  local paper_law=(--params "$params/paper.yaml" --params "$params/paper_exact.yaml")
  local steps=(${step_time:+--duration "$step_time"})
  local ellipse=(${ellipse_time:+--duration "$ellipse_time"})
  trap 'interrupted INT 130' INT
  trap 'interrupted TERM 143' TERM
  trap 'interrupted HUP 129' HUP
  for controller in paper ours; do
    law=()
    [[ $controller == ours ]] || law=("${paper_law[@]}")
    fly "$controller" steps "${law[@]}" "${steps[@]}"
    fly "$controller" ellipse "${law[@]}" "${ellipse[@]}"
    fly "$controller" ellipse_4dof "${law[@]}" "${ellipse[@]}"
  done
  trap - INT TERM HUP
  if ((signal_code)); then
    tell "interrupted; finished runs are kept in $out" >&2
    exit "$signal_code"
  fi
}

take_options "$@"
# shellcheck source=setup.sh
. "$scenario_root/setup.sh" || exit
program maglev_study paper_tables
page=("${command[@]}")
make_folder
tell "$mode, into $out"
fly_all
code=0
"${page[@]}" "$out" || code=$?
if ((code || ${#failed[@]})); then
  tell "FAILED${failed[*]:+: ${failed[*]}}"
  exit 1
fi
tell 'passed'
