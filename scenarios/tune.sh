#!/usr/bin/env bash
# The three numbers of each axis that serve the worst of many machines best. See --help.
. "$(dirname -- "${BASH_SOURCE[0]}")/start.bash" tune "$@"
