#!/usr/bin/env bash
# Machines drawn by the hundred, each flown by each law; the worst through the graph. See --help.
. "$(dirname -- "${BASH_SOURCE[0]}")/start.bash" robustness "$@"
