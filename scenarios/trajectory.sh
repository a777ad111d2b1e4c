#!/bin/sh
# A trajectory by the name of its params/scenario_NAME.yaml, or from a CSV file. See --help.
exec bash -p "$(dirname -- "$(readlink -f -- "$0")")/start.bash" trajectory "$@"
