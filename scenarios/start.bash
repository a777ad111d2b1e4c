# shellcheck shell=bash
# Becomes the runner, in the environment of this workspace, which is made first where it is missing:
#
#     bash -p start.bash NAME OPTION...
#
# -p keeps out what the caller has exported for shells of his own: functions, BASH_ENV, options.

# A shell that waits for a program heeds a SIGINT only where that program dies of it as well.
trap 'trap - INT; kill -INT $$' INT

# A closed one would be taken by the first file that is opened.
{ : 9<&0; } 2>/dev/null || exec </dev/null
{ : 9>&1; } 2>/dev/null || exec >/dev/null
{ : 9>&2; } 2>/dev/null || exec 2>/dev/null

root=${0%/*/*}

# Started with SIGINT ignored, as by `scenario.sh &` in a script, a shell could not be stopped by it.
if [[ $(trap -p INT) == *"''"* ]] && env --default-signal=INT true 2>/dev/null; then
  exec env --default-signal=INT "$BASH" -p "$0" "$@"
fi

# Before its first line Python answers SIGINT with a traceback: it waits until the runner takes it.
held=(env --block-signal=INT)
"${held[@]}" true 2>/dev/null || held=()

# The first set-up takes minutes: --help and wrong use are answered before it, where there is a
# Python that can.
if [[ ! -f $root/install/.stamp ]] &&
  python3 -Ic 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null; then
  code=0
  "${held[@]}" python3 -IS "$root/scenarios" --check "$@" || code=$?
  ((code == 75)) || exit "$code"
fi

# What the browser's view needs comes with the first flight that wants it.
for word; do
  [[ $word != --view ]] || : "${MAGLEV_SETUP:=view}"
done
export MAGLEV_SETUP

# shellcheck source=setup.sh
. "$root/setup.sh" || exit
# What else the caller's Python finds and does is for his own programs.
packages=("$root"/.venv/lib/python3*/site-packages)
export PYTHONPATH=${packages[0]}:$PYTHONPATH
unset PYTHONWARNINGS PYTHONINSPECT PYTHONIOENCODING
export PYTHONUTF8=1
# Every node warns of it; the variables that came for it say the same.
if [[ ${ROS_LOCALHOST_ONLY:-} == 1 ]]; then
  export ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST
  unset ROS_STATIC_PEERS
fi
unset ROS_LOCALHOST_ONLY
# -S: the packages of .venv take longer to find than all else, and are only needed for overlays.
exec "${held[@]}" python -S "$root/scenarios" "$@"
