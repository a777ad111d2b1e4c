#!/bin/sh
# The three numbers of each axis that serve the worst of many machines best. See --help.
exec bash -p "$(dirname -- "$(readlink -f -- "$0")")/start.bash" tune "$@"
