#!/usr/bin/env bash
# Every fault in every phase, on emulated boards, judged by what truly happens. See --help.
. "$(dirname -- "${BASH_SOURCE[0]}")/start.bash" faults "$@"
