#!/usr/bin/env bash
# Brings a machine up step by step at low current and says what is wired or set wrongly:
#
#     scenarios/commission.sh [--params OVERLAY.yaml]... [--current A] [--yes]
#
# Without an overlay it runs on the emulated boards. It asks before every step; --yes does not.
. "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"
scenario=commission
arguments=(--params "$scenario_root/params/hw_bridge.yaml")
while (($#)); do
  case $1 in
    --params)
      (($# > 1)) || refuse '--params needs a file'
      file=$(overlay "$2")
      arguments+=(--params "$file")
      shift
      ;;
    --params=*)
      file=$(overlay "${1#*=}")
      arguments+=(--params "$file")
      ;;
    *) arguments+=("$1") ;;
  esac
  shift
done
# shellcheck source=setup.sh
. "$scenario_root/setup.sh" || exit
program maglev_hw_bridge commission
exec "${command[@]}" "${arguments[@]}"
