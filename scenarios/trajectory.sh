#!/usr/bin/env bash
. "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"
heed_interrupt "$@"
names=()
for file in "$scenario_root"/params/scenario_*.yaml; do
  name=${file##*/scenario_}
  [[ $name == file.yaml || $name == single_motor_* ]] || names+=("${name%.yaml}")
done
scenario=trajectory
synopsis='trajectory.sh NAME|FILE.csv'
description="A trajectory: lifts off, follows it measured, lands.

  NAME      ${names[*]}
  FILE.csv  header t,y,x,z,phi,theta in s, m, rad; equally spaced rows; followed over and over, so
            that its last row is its first again
params/matched_NAME.yaml, where there is one, is an overlay with internal models to match."
case ${1:---help} in
  --help | -h) usage && exit 0 ;;
  *.csv)
    [[ -f $1 && -r $1 ]] || refuse "cannot read '$1'"
    reference_arguments=(-p "file.path:='$(realpath -- "$1")'")
    name=file
    ;;
  *) name=$(one_of 'the trajectory' "$1" "${names[@]}") ;;
esac
shift
run_scenario "$name" "$description" "params/scenario_$name.yaml" -- "$@"
