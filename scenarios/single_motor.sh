#!/bin/sh
# Two runs of the single-motor machine, one after another, each in a folder of its own under --out.
exec bash -p "$(dirname -- "$(readlink -f -- "$0")")/start.bash" single_motor "$@"
