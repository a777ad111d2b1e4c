#!/usr/bin/env bash
# The paper's ellipse with theta turning along: lifts off, follows it for 60 s measured, lands.
. "$(dirname -- "${BASH_SOURCE[0]}")/start.bash" ellipse_4dof "$@"
