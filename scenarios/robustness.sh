#!/bin/sh
# Machines drawn by the hundred, each flown by each law; the worst through the graph. See --help.
exec bash -p "$(dirname -- "$(readlink -f -- "$0")")/start.bash" robustness "$@"
