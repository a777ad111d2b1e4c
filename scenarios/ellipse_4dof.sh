#!/bin/sh
# The paper's ellipse with theta turning along: lifts off, follows it for 60 s measured, lands.
exec bash -p "$(dirname -- "$(readlink -f -- "$0")")/start.bash" ellipse_4dof "$@"
