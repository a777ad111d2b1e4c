#!/usr/bin/env bash
# Two runs, one after another, each in a folder of its own under --out.
. "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"
heed_interrupt "$@"
scenario=single_motor base='' rest=()
while (($#)); do
  case $1 in
    --out=*) base=${1#*=} && shift ;;
    --out)
      (($# > 1)) || refuse '--out needs a value; see --help'
      base=$2
      shift 2
      ;;
    *) rest+=("$1") && shift ;;
  esac
done
base=${base:-$scenario_root/runs/single_motor-$(date +%Y%m%d-%H%M%S)}

for part in steps sinusoids; do
  (run_scenario single_motor \
    "The single-motor machine of refs. [10], [11]: steps, then sinusoids, in air gap and displacement." \
    params/single_motor.yaml "params/scenario_single_motor_$part.yaml" -- \
    "${rest[@]}" --out "$base/$part") || exit
  [[ " ${rest[*]} " != *' --help '* && " ${rest[*]} " != *' -h '* ]] || break
done
