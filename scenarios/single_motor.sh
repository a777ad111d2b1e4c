#!/usr/bin/env bash
# Two runs of the single-motor machine, one after another, each in a folder of its own under --out.
. "$(dirname -- "${BASH_SOURCE[0]}")/start.bash" single_motor "$@"
