#!/usr/bin/env bash
. "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"
run_scenario steps \
  "The steps of the paper's Table III in y, x, z and theta, each from rest, other axes held." \
  params/scenario_steps.yaml -- "$@"
