#!/usr/bin/env bash
# The paper's ellipse in y, x and z: lifts off, follows it for 60 s measured, lands.
. "$(dirname -- "${BASH_SOURCE[0]}")/start.bash" ellipse "$@"
