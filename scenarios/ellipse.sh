#!/bin/sh
# The paper's ellipse in y, x and z: lifts off, follows it for 60 s measured, lands.
exec bash -p "$(dirname -- "$(readlink -f -- "$0")")/start.bash" ellipse "$@"
