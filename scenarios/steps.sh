#!/bin/sh
# The steps of the paper's Table III in y, x, z and theta, each from rest, other axes held.
exec bash -p "$(dirname -- "$(readlink -f -- "$0")")/start.bash" steps "$@"
