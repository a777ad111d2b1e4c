#!/usr/bin/env bash
# A trajectory by the name of its params/scenario_NAME.yaml, or from a CSV file. See --help.
. "$(dirname -- "${BASH_SOURCE[0]}")/start.bash" trajectory "$@"
