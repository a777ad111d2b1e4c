# shellcheck shell=bash
# The steps of the set-up, each quiet on success and explained in one line on failure.

declare -A titles=() begun=() # of the steps at work, by the process that does them
beginning=''                  # title of the one that is begun, and not among them yet

# Show a step and its seconds while COMMAND works; its output goes to the log.
step() { # TITLE COMMAND...
  begin "$@"
  finish $!
}

# Begin a step that goes on beside those that follow.
begin() { # TITLE COMMAND...
  local title=$1
  shift
  [[ -t 2 ]] || say "$title"
  beginning=$title
  set -m # a process group of its own, for stop_steps
  (
    set +m
    exec >"$log.$BASHPID" 2>&1 </dev/null
    "$@"
  ) &
  set +m
  titles[$!]=$title
  begun[$!]=$SECONDS
  beginning=''
}

# Wait for JOB, or else for all that were begun. The first that fails ends the others and the set-up.
finish() { # [JOB]
  local job code
  while ((${#titles[@]})) && [[ -z ${1:-} || -n ${titles[$1]:-} ]]; do
    for job in "${!titles[@]}"; do
      if ! kill -0 "$job" 2>/dev/null; then
        code=0
        wait "$job" || code=$?
        ended "$job" "$code"
      fi
    done
    show_steps
    sleep 0.1
  done
}

ended() { # JOB CODE
  local title=${titles[$1]} took=$((SECONDS - ${begun[$1]})) output
  output=$(<"$log.$1")
  forget "$1"
  if (($2)); then
    stop_steps
    explain "$title" "$output"
  fi
  [[ ! -t 2 ]] || printf '\r\e[Ksetup: %s (%d s)\n' "$title" "$took" >&2
}

forget() { # JOB
  { printf '\n== %s\n' "${titles[$1]}" && cat -- "$log.$1" || true; } >>"$log" 2>/dev/null
  unset "titles[$1]" "begun[$1]"
  rm -f -- "$log.$1"
}

show_steps() {
  local job first='' others=''
  [[ -t 2 ]] || return 0
  for job in "${!titles[@]}"; do
    [[ -n $first ]] && ((begun[$job] >= begun[$first])) || first=$job
  done
  [[ -n $first ]] || return 0
  ((${#titles[@]} == 1)) || others=" and $((${#titles[@]} - 1)) more"
  printf '\r\e[Ksetup: %s%s ... %d s' "${titles[$first]}" "$others" \
    $((SECONDS - begun[$first])) >&2
}

stop_steps() {
  local job
  [[ -z $beginning ]] || for job in $(jobs -p); do
    titles[$job]=${titles[$job]:-$beginning}
  done
  for job in "${!titles[@]}"; do
    kill -- "-$job" 2>/dev/null || true
  done
  for job in "${!titles[@]}"; do
    wait "$job" 2>/dev/null || true
    forget "$job"
  done
}

interrupted() { # SIGNAL CODE
  trap - INT TERM HUP
  stop_steps
  [[ ! -t 2 ]] || printf '\n' >&2
  say 'interrupted: the next run completes it'
  exit "$2"
}

# Whether the disk is full: a step whose words go to that disk cannot always say so.
disk_is_full() { # OUTPUT
  local full=''
  head -c 65536 /dev/zero >"$log.try" || full=yes
  rm -f -- "$log.try"
  [[ -n $full || $1 == *'No space left on device'* || $1 == *'Errno 28'* ]]
} 2>/dev/null

# End the set-up with the most telling line of what the step said.
explain() { # TITLE OUTPUT
  [[ ! -t 2 ]] || printf '\r\e[K' >&2
  local cause network='NewConnectionError|NameResolutionError|Temporary failure in name'
  network+='|Network is unreachable|Connection refused|ConnectTimeout|ReadTimeout'
  network+='|SSLError|Connection aborted|connection broken'
  if [[ $2 == *'Disk quota exceeded'* ]]; then
    cause='the disk quota is used up: make room'
  elif disk_is_full "$2"; then
    cause="no space left on the disk of $root or of ${TMPDIR:-/tmp}: make room"
  elif grep -qE ' Killed  |Killed signal' <<<"$2"; then
    cause='the system has killed it, as where memory runs out: end other programs'
  elif [[ $2 == *ProxyError* ]]; then
    cause='pip cannot reach the proxy that https_proxy or its settings name: correct that'
  elif grep -qE "$network" <<<"$2"; then
    cause='no network, pip cannot reach its package index: connect, or set https_proxy'
  else
    cause=$(grep -v '^CMake Error at' <<<"$2" |
      grep -m 1 -E '(rror|Exception|Invalid[A-Za-z]*|ERROR)\b.*: ') ||
      cause=$(tail -n 1 <<<"$2")
    cause="${cause:0:200} (all of it: $log); mend that"
  fi
  [[ -f $venv/.stamp ]] || remove_venv || true
  fail "$1 failed: $cause; then run again"
}

# Its mark, by which the next set-up knows it for its own, goes last: rm may be killed on its way.
remove_venv() {
  [[ ! -d $venv ]] || find "$venv" -mindepth 1 -maxdepth 1 ! -name .made-by-setup -exec rm -rf {} +
  rm -rf -- "$venv"
}

# pip of the environment: of the caller's own settings it takes where packages are, and nothing
# else. Most modules are never used: those that are, are compiled when they are (see warm_up).
pip_install() {
  local theirs=("${!PIP_@}") settings
  mapfile -d '' settings < <("$venv/bin/python" -I "$root/setup/pip_settings.py")
  env "${theirs[@]/#/-u}" "${settings[@]}" PIP_CONFIG_FILE=/dev/null \
    PIP_DISABLE_PIP_VERSION_CHECK=1 _ROS_WHEELS_BOOTSTRAP_COMPLETE=1 PYTHONNOUSERSITE=1 \
    bash -c "${ros_setup:+. $ros_setup; } exec \"\$@\"" - \
    "$venv/bin/python" -m pip install --no-input --no-compile --progress-bar off \
    --no-warn-conflicts --retries 2 "$@"
}

install_test_tools() { # FOLDER
  pip_install -r "$root/setup/requirements-test.txt" --target "$1"
  pip_install -r "$root/setup/requirements-test-nodeps.txt" --no-deps --target "$1"
}

# The message modules of an installed ROS are compiled against the NumPy it came with: pin that one.
keep_numpy() {
  PYTHONNOUSERSITE=1 bash -c "${ros_setup:+. $ros_setup >/dev/null; } exec \"\$@\"" - \
    "$python" -c 'import numpy; print("numpy==" + numpy.__version__)'
}

# The wheels' CMake files name the Python of the machine they were made on.
fit_wheels() {
  local include numpy_include made='/opt/python/cp[0-9]+-cp[0-9]+'
  include=$("$venv/bin/python" -I -c 'import sysconfig; print(sysconfig.get_paths()["include"])')
  numpy_include=$("$venv/bin/python" -I -c 'import numpy; print(numpy.get_include())')
  grep -rlZ --include='*.cmake' /opt/python/cp3 "$venv/share" | xargs -0 sed -i -E \
    -e "s#$made/lib/python[0-9.]+/site-packages/numpy/_core/include#$numpy_include#g" \
    -e "s#$made/include/python[0-9.]+#$include#g"
  ! grep -rl --include='*.cmake' /opt/python/cp3 "$venv/share"
}

# The shell code that gives the underlying ROS, for a process that starts from a bare environment.
underlay() {
  if [[ $branch == native ]]; then
    printf '. %q\n' "$ros_setup"
    return
  fi
  local libraries
  libraries=$(printf ':%s' "$venv/lib" "$venv"/lib/python3*/site-packages/ros_*.libs)
  printf 'export %s=%q\n' AMENT_PREFIX_PATH "$venv" CMAKE_PREFIX_PATH "$venv" \
    LD_LIBRARY_PATH "${libraries#:}" _ROS_WHEELS_BOOTSTRAP_COMPLETE 1 \
    RMW_IMPLEMENTATION rmw_fastrtps_cpp ROS_DISTRO jazzy ROS_VERSION 2 ROS_PYTHON_VERSION 3
}

# Run COMMAND in the underlay and nothing else of the caller's environment but what a build may
# need; his own defaults for colcon are none of it.
in_underlay() {
  local name keep=()
  for name in HOME USER TMPDIR TERM CC CXX CFLAGS CXXFLAGS LDFLAGS CMAKE_GENERATOR MAKEFLAGS; do
    [[ -z ${!name:-} ]] || keep+=("$name=${!name}")
  done
  env -i "${keep[@]}" PATH="$venv/bin:$PATH" LC_ALL=C.UTF-8 PYTHONNOUSERSITE=1 \
    COLCON_HOME="$cache/colcon" \
    bash -c "$(underlay)"$'\nexec "$@"' - "$@"
}

underlay_has() { # PACKAGE
  in_underlay bash -c 'IFS=: read -ra prefixes <<<"$AMENT_PREFIX_PATH"
for prefix in "${prefixes[@]}"; do
  [[ ! -f $prefix/share/$0/package.xml ]] || exit 0
done
exit 1' "$1"
}

build_packages() { # COLCON'S OPTION...
  local paths=(src) options=()
  cd "$root"
  underlay_has tf2_msgs || paths+=(setup/tf2_msgs)
  [[ $branch == native ]] ||
    options=("-DCMAKE_PROJECT_INCLUDE=$root/setup/python_messages.cmake")
  in_underlay "$venv/bin/python" \
    -c 'from colcon_core.command import main; raise SystemExit(main())' \
    --log-base .cache/colcon build --base-paths "${paths[@]}" --build-base build \
    --install-base install --symlink-install --event-handlers console_direct- console_cohesion+ \
    "$@" \
    --cmake-args "-DPython3_EXECUTABLE=$venv/bin/python" -DBUILD_TESTING=OFF \
    -DCMAKE_POLICY_VERSION_MINIMUM=3.5 --no-warn-unused-cli "${options[@]}"
}

# environment.bash: every path the underlay and the workspace add, moved to the front, and the
# settings.
write_and_check_environment() {
  local file=$root/install/environment.bash name value ours=''
  # The wheels have no ros2 command. Ours comes last: a real one on PATH is the one that is run.
  local small_ros2=$root/install/maglev_ros2cli/lib/maglev_ros2cli
  [[ $branch == wheels ]] || ours=:$(echo "$venv"/lib/python3*/site-packages)
  {
    cat <<'END'
# shellcheck shell=bash
# Written by setup/install.sh. Puts this workspace and its ROS into a bash or a zsh.
__maglev_first() { # NAME ENTRY...
  local name=$1 entry rest ours=''
  eval "rest=:\${$1-}:"
  shift
  for entry; do
    while [[ $rest == *":$entry:"* ]]; do
      rest=${rest/":$entry:"/:}
    done
    ours+=${entry}:
  done
  rest=${rest#:}
  rest=$ours${rest%:}
  export "$name=${rest%:}"
}
__maglev_last() { # NAME ENTRY
  local rest
  eval "rest=:\${$1-}:"
  while [[ $rest == *":$2:"* ]]; do
    rest=${rest/":$2:"/:}
  done
  rest=${rest#:}
  export "$1=$rest$2"
}
END
    in_underlay bash -c ". '$root/install/local_setup.bash' && env -0" |
      while IFS='=' read -rd '' name value; do
        case $name in
          PATH) first PATH "$venv/bin:$(paths_of_ros "$value")" ;;
          PYTHONPATH) first "$name" "$value$ours" ;;
          *_PREFIX_PATH | LD_LIBRARY_PATH | PKG_CONFIG_PATH) first "$name" "$value" ;;
          ROS_DISTRO | ROS_VERSION | ROS_PYTHON_VERSION) setting "$name" "$value" ;;
          _ROS_WHEELS_BOOTSTRAP_COMPLETE) setting "$name" "$value" ;;
          RMW_IMPLEMENTATION) [[ $branch == native ]] || setting "$name" "$value" ;;
        esac
      done
    setting PYTHONNOUSERSITE 1
    echo 'unset PYTHONHOME' # with which .venv finds no library
    printf 'export NUMBA_CACHE_DIR=%q"/$(<%q)"\n' "$cache/numba" "$cache/numba/current"
    echo 'if [ "${MAGLEV_SETUP:-}" = test ]; then'
    first PATH "$cache/test-tools/bin"
    first PYTHONPATH "$cache/test-tools"
    echo 'fi'
    [[ $branch == native ]] || printf '__maglev_last PATH %q\n' "$small_ros2"
    # zsh completes where its user has started that, and then as bash does.
    echo 'if [ -n "${BASH_VERSION:-}" ] || { command -v compdef && autoload -U +X bashcompinit &&'
    echo '  bashcompinit; } >/dev/null; then'
    [[ $branch == native ]] ||
      in_underlay "$venv/bin/register-python-argcomplete" --shell bash ros2
    printf '. %q\n' "$root/scenarios/complete.bash"
    echo 'fi'
    default ROS_AUTOMATIC_DISCOVERY_RANGE LOCALHOST
    default OPENBLAS_NUM_THREADS 1
    default OMP_NUM_THREADS 1
    echo 'unset -f __maglev_first __maglev_last'
  } >"$file.new"
  mv -f -- "$file.new" "$file"
  in_environment python -c 'import maglev_msgs.msg, matplotlib, numba, rclpy, rosbags, scipy
import tf2_msgs.msg
rclpy.init()
rclpy.create_node("check").create_publisher(maglev_msgs.msg.Measurement, "check", 1)
rclpy.shutdown()'
  # So that the first run need not compile their modules; what fails there is that run's to tell.
  in_environment python -c 'import maglev_controller.node, maglev_plant.node, maglev_reference.node
import maglev_monitor.bag.recorder, maglev_monitor.live.node, maglev_monitor.report.run_report
import maglev_hw_bridge.node, maglev_view.node' || true
}

setting() { printf 'export %s=%q\n' "$1" "$2"; }

default() { printf '[ -n "${%s:-}" ] || %s=%q\nexport %s\n' "$1" "$1" "$2" "$1"; }

first() { # NAME VALUE
  local entry entries
  IFS=: read -ra entries <<<"$2"
  printf '__maglev_first %s' "$1"
  for entry in "${entries[@]}"; do
    [[ -z $entry ]] || printf ' %q' "$entry"
  done
  printf '\n'
}

# What the ROS of the machine adds to PATH.
paths_of_ros() {
  local entry entries found=''
  IFS=: read -ra entries <<<"$1"
  for entry in "${entries[@]}"; do
    [[ -z $ros_prefix || $entry != "$ros_prefix"* ]] || found+=$entry:
  done
  echo "${found%:}"
}

in_environment() {
  env -i HOME="${HOME:-$root}" ROS_LOG_DIR="$cache/ros" PATH="$PATH" LC_ALL=C.UTF-8 \
    bash -c ". '$root/install/environment.bash' && exec \"\$@\"" - "$@"
}

# Compile ahead what flies, so that the first run starts as quickly as the second. In two processes,
# the plant first in one and last in the other, so that what both need is compiled once. Only speed
# depends on it: a defect of the code is left for a run or the tests. The messages may still be
# missing.
warm_up() {
  in_packages python "$root/setup/compile_ahead.py" answer &
  in_packages python "$root/setup/compile_ahead.py" stage || echo 'not compiled'
  wait $! || echo 'not compiled'
}

# Run COMMAND with the packages that are built so far.
in_packages() {
  in_underlay bash -c '. "$0" && NUMBA_CACHE_DIR=$1 exec "${@:2}"' \
    "$root/install/local_setup.bash" "$cache/numba/$sources" "$@"
}
