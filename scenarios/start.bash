# shellcheck shell=bash
# Becomes the runner, in the environment of this workspace, which is made first where it is missing:
#
#     . start.bash NAME OPTION...
#
root=$(CDPATH='' cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P) || exit

# Started with SIGINT ignored, as by `scenario.sh &` in a script, a shell could not be stopped by it.
if [[ $(trap -p INT) == *"''"* ]] && env --default-signal=INT true 2>/dev/null; then
  exec env --default-signal=INT "$BASH" "$0" "${@:2}"
fi

# The first set-up takes minutes: --help and wrong use are answered before it, where there is a
# Python that can.
if [[ ! -f $root/install/.stamp ]] &&
  python3 -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null; then
  code=0
  python3 "$root/scenarios" --check "$@" || code=$?
  ((code == 75)) || exit "$code"
fi

# shellcheck source=setup.sh
. "$root/setup.sh" || exit
exec python "$root/scenarios" "$@"
