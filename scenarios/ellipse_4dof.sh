#!/usr/bin/env bash
. "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"
run_scenario ellipse_4dof \
  "The paper's ellipse with theta turning along: lifts off, follows it for 60 s measured, lands." \
  params/scenario_ellipse_4dof.yaml -- "$@"
