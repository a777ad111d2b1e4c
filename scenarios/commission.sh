#!/bin/sh
# Brings a machine up step by step at low current and says what is wired or set wrongly. See --help.
exec bash -p "$(dirname -- "$(readlink -f -- "$0")")/start.bash" commission "$@"
