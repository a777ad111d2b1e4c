#!/usr/bin/env bash
# Hundreds of runs: the closed loop as a library, no nodes. See --help.
. "$(dirname -- "${BASH_SOURCE[0]}")/start.bash" compare "$@"
