#!/bin/sh
# Every fault in every phase, on emulated boards, judged by what truly happens. See --help.
exec bash -p "$(dirname -- "$(readlink -f -- "$0")")/start.bash" faults "$@"
