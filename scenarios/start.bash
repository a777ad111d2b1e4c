# shellcheck shell=bash
# Becomes the runner, in the environment of this workspace, which is made first where it is missing:
#
#     . start.bash NAME OPTION...
#
# A shell that waits for a program heeds a SIGINT only where that program dies of it as well.
trap 'trap - INT; kill -INT $$' INT

root=$(CDPATH='' cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P) || exit

# Started with SIGINT ignored, as by `scenario.sh &` in a script, a shell could not be stopped by it.
if [[ $(trap -p INT) == *"''"* ]] && env --default-signal=INT true 2>/dev/null; then
  exec env --default-signal=INT "$BASH" "$0" "${@:2}"
fi

# Before its first line Python answers SIGINT with a traceback: it waits until the runner takes it.
held=(env --block-signal=INT)
"${held[@]}" true 2>/dev/null || held=()

# The first set-up takes minutes: --help and wrong use are answered before it, where there is a
# Python that can.
if [[ ! -f $root/install/.stamp ]] &&
  python3 -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null; then
  code=0
  "${held[@]}" python3 -S "$root/scenarios" --check "$@" || code=$?
  ((code == 75)) || exit "$code"
fi

# What the browser's view needs comes with the first flight that wants it.
for word; do
  [[ $word != --view ]] || : "${MAGLEV_SETUP:=view}"
done
export MAGLEV_SETUP

# shellcheck source=setup.sh
. "$root/setup.sh" || exit
# -S: the packages of .venv take longer to find than all else, and are only needed for overlays.
exec "${held[@]}" python -S "$root/scenarios" "$@"
