#!/usr/bin/env bash
. "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"
run_scenario ellipse \
  "The paper's ellipse in y, x and z: lifts off, follows it for 60 s measured, lands." \
  params/scenario_ellipse.yaml -- "$@"
