#!/usr/bin/env bash
# The steps of the paper's Table III in y, x, z and theta, each from rest, other axes held.
. "$(dirname -- "${BASH_SOURCE[0]}")/start.bash" steps "$@"
