#!/bin/sh
# Hundreds of runs: the closed loop as a library, no nodes. See --help.
exec bash -p "$(dirname -- "$(readlink -f -- "$0")")/start.bash" compare "$@"
