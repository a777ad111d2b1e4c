#!/usr/bin/env bash
# Hundreds of runs: the closed loop as a library, no nodes. See --help.
. "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"
scenario=compare out='' options=()

usage() {
  cat <<'END'
Flies all control laws over the same steps, ellipses, disturbances and mismatches on the benchmark
plant, prints one table and draws their regions of operation. A few minutes on two cores.

usage: scenarios/compare.sh [options]
  --out DIR           where the results are left (default runs/compare-<time>)
  --quick             coarse regions and short windows
  --laws NAME...      only these: files of params/laws, paper, default
  --bandwidth RAD_S   crossover of the laws with compensators, on all axes (default: as in their files)
  --help              this text
END
}

while (($#)); do
  case $1 in
    --help | -h) usage && exit 0 ;;
    --out=*) out=${1#*=} && shift ;;
    --out)
      (($# > 1)) || refuse '--out needs a value; see --help'
      out=$2
      shift 2
      ;;
    *) options+=("$1") && shift ;;
  esac
done

# shellcheck source=setup.sh
. "$scenario_root/setup.sh" || exit
program maglev_study compare
exec "${command[@]}" "${options[@]}" --params "$scenario_root/params" \
  --out "${out:-$scenario_root/runs/compare-$(date +%Y%m%d-%H%M%S)}"
