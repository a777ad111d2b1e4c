#!/usr/bin/env bash
# Brings a machine up step by step at low current and says what is wired or set wrongly. See --help.
. "$(dirname -- "${BASH_SOURCE[0]}")/start.bash" commission "$@"
