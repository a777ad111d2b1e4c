# shellcheck shell=bash
# What every scenario is made of: options, the nodes of the graph, their orderly end. Sourced by
# them:
#
#     run_scenario NAME DESCRIPTION PARAMETER_FILE... -- "$@"
#
# Nodes are jobs with process groups of their own, so a Ctrl-C reaches this shell alone, which then
# stops them in order: reference and controller first (no current flows), then the stage, then who
# watches.
set -euo pipefail

scenario_root=$(CDPATH='' cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
start_order=(recorder monitor stage controller reference)
stop_order=(reference controller stage monitor recorder)
declare -A pid_of=() code_of=()
signal_code=0
synopsis=''            # what a scenario is called with, where that is more than its name
reference_arguments=() # and what of that goes to the reference

tell() {
  printf '%s: %s\n' "$scenario" "$*"
}

refuse() { # MESSAGE: what the user asked for cannot be done
  printf '%s: error: %s\n' "$scenario" "$*" >&2
  exit 2
}

usage() {
  cat <<END
$description

usage: scenarios/${synopsis:-$scenario.sh} [options]
  --stage plant|hw_bridge   what is levitated: the simulated plant, or the hardware (default plant)
  --mode lockstep|realtime  as fast as it computes and repeatable, or 1 kHz by the clock
                            (default lockstep)
  --duration S              measured time: of the tracking window, or of each step [s]
  --params OVERLAY.yaml     parameters on top of the scenario's, from the current folder or from
                            params/; repeatable, the last one wins
  --out DIR                 where the run is left (default runs/$scenario-<time>)
  --help                    this text
END
}

# -- options ---------------------------------------------------------------------------------------

parse_options() {
  stage=plant mode=lockstep duration='' out='' overlays=()
  while (($#)); do
    local option=$1 value
    shift
    case $option in
      --help | -h) usage && exit 0 ;;
      --*=*) value=${option#*=} option=${option%%=*} ;;
      --stage | --mode | --duration | --params | --out)
        (($#)) || refuse "$option needs a value; see --help"
        value=$1
        shift
        ;;
      *) value='' ;;
    esac
    take_option "$option" "$value"
  done
}

take_option() { # OPTION VALUE
  case $1 in
    --stage) stage=$(one_of "$@" plant hw_bridge) ;;
    --mode) mode=$(one_of "$@" lockstep realtime) ;;
    --duration) duration=$(seconds "$2") ;;
    --params) overlays+=("$(overlay "$2")") ;;
    --out) out=$2 && [[ -n $out ]] || refuse '--out needs a folder' ;;
    *) refuse "unknown option '$1'; see --help" ;;
  esac
}

one_of() { # OPTION VALUE CHOICE...
  local option=$1 value=$2 choice
  shift 2
  for choice; do
    if [[ $value == "$choice" ]]; then
      echo "$value"
      return
    fi
  done
  refuse "$option is '$value', it must be one of: $*"
}

# A duration as ROS reads a double: with a point.
seconds() { # VALUE
  [[ $1 =~ ^[0-9]+\.?[0-9]*$ && $1 =~ [1-9] ]] ||
    refuse "--duration is '$1', it must be a number of seconds above 0"
  [[ $1 == *.* ]] && echo "${1}0" || echo "$1.0"
}

overlay() { # NAME
  local file section
  for file in "$1" "$scenario_root/params/$1" "$scenario_root/params/$1.yaml" ''; do
    [[ ! -f $file ]] || break
  done
  [[ -n $file ]] || refuse "--params: there is no file '$1', here or in $scenario_root/params"
  [[ -r $file ]] || refuse "--params: cannot read '$file'"
  while IFS= read -r section; do
    case ${section//[\'\"]/} in
      plant | hw_bridge | controller | reference | monitor | recorder | '/**') ;;
      *) refuse "--params: '$file' has parameters for '$section', which is no node of a scenario" ;;
    esac
  done < <(sed -nE 's/^([^[:space:]#:-][^:]*):.*/\1/p' -- "$file")
  realpath -- "$file"
}

# -- the folder of the run
# ---------------------------------------------------------------------------

make_folder() {
  local name
  if [[ -z $out ]]; then
    name=$scenario_root/runs/$scenario-$(date +%Y%m%d-%H%M%S)
    out=$name
    [[ ! -e $out ]] || out=$name-$$
  fi
  for name in bag log params metrics.json report.html; do
    [[ ! -e $out/$name ]] || refuse "'$out' already holds a run: choose another --out"
  done
  # The log folder holds a whole block at once, so that a full disk shows now and not when the stage
  # flies.
  if ! { mkdir -p -- "$out/log" "$out/params" && head -c 65536 /dev/zero >"$out/log/.try" &&
    rm -- "$out/log/.try"; } 2>/dev/null; then
    rmdir -- "$out/log" "$out/params" 2>/dev/null || true
    refuse "cannot write to '$out': check its permissions and the space left," \
      'or choose another --out'
  fi
  out=$(realpath -- "$out")
}

# -- nodes
# -------------------------------------------------------------------------------------------

# Sets node_package and node_executable.
node_program() { # NODE
  case $1 in
    stage) node_package=maglev_$stage node_executable=$stage ;;
    monitor | recorder) node_package=maglev_monitor node_executable=$1 ;;
    *) node_package=maglev_$1 node_executable=$1 ;;
  esac
}

installed() { # PACKAGE EXECUTABLE
  local prefix prefixes
  IFS=: read -ra prefixes <<<"${AMENT_PREFIX_PATH:-}"
  for prefix in "${prefixes[@]}"; do
    if [[ -x $prefix/lib/$1/$2 ]]; then
      echo "$prefix/lib/$1/$2"
      return
    fi
  done
  refuse "no executable '$2' of package '$1' in this workspace: build it, or choose another --stage"
}

# Sets command: how to run an executable, so that it dies with the one that started it.
program() { # PACKAGE EXECUTABLE
  local path bound=()
  path=$(installed "$1" "$2")
  ! command -v setpriv >/dev/null || bound=(setpriv --pdeathsig TERM)
  if command -v ros2 >/dev/null; then
    command=("${bound[@]}" ros2 run ${bound:+--prefix "${bound[*]}"} "$1" "$2")
  else
    command=("${bound[@]}" "$path")
  fi
}

# Sets arguments: the parameters of a node, each file over the one before.
node_arguments() { # NODE
  local name=$1 file
  [[ $name != stage ]] || name=$stage
  arguments=(--ros-args --disable-external-lib-logs)
  for file in "$scenario_root/params/$name.yaml" "${files[@]}" "${overlays[@]}"; do
    [[ ! -f $file ]] || arguments+=(--params-file "$file")
  done
  arguments+=(-p "effective_parameters:=$out/params/$name.yaml")
  case $1 in
    stage | controller) arguments+=(-p "mode:=$mode" -p watchers:=2) ;;
    reference)
      arguments+=(-p "mode:=$mode" -p watchers:=2 -p autostart:=true -p exit_at_end:=false)
      [[ $mode != realtime ]] || arguments+=(-p lead:=128) # for when the machine holds it up
      arguments+=("${reference_arguments[@]}")
      [[ -z $duration ]] || arguments+=(-p "duration:=$duration")
      ;;
    monitor)
      arguments+=(-p exit_at_end:=true -p "output:=$out/metrics.json"
        -p "scenario:=$scenario" -p "stage:=$stage" -p "mode:=$mode")
      ;;
    recorder) arguments+=(-p "output:=$out/bag") ;;
  esac
}

start_node() { # NODE
  node_program "$1"
  program "$node_package" "$node_executable"
  node_arguments "$1"
  set -m
  "${command[@]}" "${arguments[@]}" >"$out/log/$1.log" 2>&1 </dev/null &
  pid_of[$1]=$!
  set +m
}

# Take note of nodes that have ended; true when one has.
collect() {
  local node found=1
  for node in "${!pid_of[@]}"; do
    if [[ -z ${code_of[$node]:-} ]] && ! kill -0 "${pid_of[$node]}" 2>/dev/null; then
      code_of[$node]=0
      wait "${pid_of[$node]}" 2>/dev/null || code_of[$node]=$?
      found=0
    fi
  done
  return "$found"
}

# Wait up to SECONDS for a node to end; true when it has.
wait_for() { # NODE SECONDS
  local tick
  for ((tick = 0; tick < $2 * 20; tick++)); do
    collect || true
    [[ -z ${code_of[$1]:-} ]] || return 0
    pause 0.05
  done
  return 1
}

pause() { # SECONDS, without a process, and over at once when a signal comes
  read -rt "$1" -u "$clock" || true
}

stop_node() { # NODE
  [[ -n ${pid_of[$1]:-} ]] || return 0
  local signal patience=8
  for signal in INT TERM KILL; do
    [[ -z ${code_of[$1]:-} ]] || break
    kill "-$signal" -- "-${pid_of[$1]}" 2>/dev/null || true
    ! wait_for "$1" "$patience" || break
    patience=3
  done
  kill -KILL -- "-${pid_of[$1]}" 2>/dev/null || true # what it may have started itself
}

stop_nodes() {
  local node
  for node in "${stop_order[@]}"; do
    stop_node "$node"
  done
}

# The line of its log that says why a node ended.
last_words() { # NODE
  local lines
  lines=$(grep -vE '^\[ros2run\]|^[[:space:]]*$' "$out/log/$1.log" 2>/dev/null) || lines=''
  { grep -iE 'error|fatal|refused' <<<"$lines" || echo "$lines"; } | tail -n 1
}

report_early_end() { # NODE
  local words
  words=$(last_words "$1")
  tell "failed: $1 ended early with exit code ${code_of[$1]}: ${words:-it said nothing}" >&2
  tell "its log: $out/log/$1.log" >&2
}

# Until the monitor ends; false when a node ends before it does.
watch_nodes() {
  local node early
  while ((!signal_code)); do
    early=0
    pause 0.1
    collect || continue
    for node in "${start_order[@]}"; do
      if [[ -n ${code_of[$node]:-} && ($node != monitor || ! -f $out/metrics.json) ]]; then
        report_early_end "$node"
        early=1
      fi
    done
    ((!early)) || return 1
    [[ -z ${code_of[monitor]:-} ]] || return 0
  done
}

# -- the run
# -----------------------------------------------------------------------------------------

show_progress() {
  set -m
  tail -n +1 -s 0.2 --pid="${pid_of[monitor]}" -f -- "$out/log/monitor.log" 2>/dev/null |
    grep --line-buffered -v '^\[ros2run\]' &
  progress=$!
  set +m
}

end_progress() {
  [[ -n ${progress:-} ]] || return 0
  local tick
  for ((tick = 0; tick < 20; tick++)); do
    kill -0 "$progress" 2>/dev/null || break
    pause 0.05
  done
  kill "$progress" 2>/dev/null || true
  wait "$progress" 2>/dev/null || true
  progress=''
}

clean_ends() {
  local node clean=0
  for node in "${stop_order[@]}"; do
    case $node:${code_of[$node]:-none} in
      monitor:* | *:0 | *:130) ;;
      *)
        tell "failed: $node did not end cleanly, exit code ${code_of[$node]:-none}:" \
          "$(last_words "$node")" >&2
        clean=1
        ;;
    esac
  done
  return "$clean"
}

analyse_run() {
  local code=0
  program maglev_monitor analyze
  "${command[@]}" "$out/bag" --out "$out" >"$out/log/analyze.log" 2>&1 || code=$?
  if ((code > 1)) || [[ ! -s $out/report.html ]]; then
    tell "failed: no report: $(tail -n 1 "$out/log/analyze.log")" >&2
    return 1
  fi
}

say_where() {
  local name
  for name in report.html metrics.json bag params log; do
    [[ ! -e $out/$name ]] || printf '  %s\n' "$out/$name"
  done
}

end_run() { # CODE, after which nothing of the run is left
  trap '' INT TERM HUP
  trap - EXIT
  stop_nodes
  end_progress
  exit "$1"
}

run_nodes() {
  local node result=0
  exec {clock}<> <(:)
  trap 'end_run 1' EXIT
  trap 'signal_code=130' INT
  trap 'signal_code=143' TERM
  trap 'signal_code=129' HUP
  for node in "${start_order[@]}"; do
    start_node "$node"
  done
  show_progress
  watch_nodes || result=1
  trap '' INT TERM HUP
  stop_nodes
  end_progress
  trap - EXIT INT TERM HUP
  return "$result"
}

# A shell started with SIGINT ignored, as by `scenario.sh &` in a script, could not be stopped by
# it.
heed_interrupt() { # OPTION...
  if [[ $(trap -p INT) == *"''"* ]] && env --default-signal=INT true 2>/dev/null; then
    exec env --default-signal=INT bash "$0" "$@"
  fi
}

run_scenario() { # NAME DESCRIPTION PARAMETER_FILE... -- OPTION...
  scenario=$1 description=$2 files=()
  shift 2
  while [[ $1 != -- ]]; do
    files+=("$scenario_root/$1")
    shift
  done
  shift
  heed_interrupt "$@"
  parse_options "$@"
  # shellcheck source=setup.sh
  . "$scenario_root/setup.sh" || exit
  for node in "${start_order[@]}"; do
    node_program "$node"
    installed "$node_package" "$node_executable" >/dev/null
  done
  make_folder
  export PYTHONUNBUFFERED=1 RCUTILS_COLORIZED_OUTPUT=0 RCUTILS_LOGGING_USE_STDOUT=0
  export RCUTILS_CONSOLE_OUTPUT_FORMAT='{severity} {time} {message}'
  tell "$stage, $mode, into $out"
  local failed=0
  run_nodes || failed=1
  if ((signal_code)); then
    tell 'interrupted; what was recorded is kept:' >&2
    say_where
    exit "$signal_code"
  fi
  if ((!failed)); then
    clean_ends || failed=1
    analyse_run || failed=1
    ((code_of[monitor] == 0)) || failed=1
  fi
  ((failed)) && tell 'FAILED' || tell 'passed'
  say_where
  exit "$failed"
}
