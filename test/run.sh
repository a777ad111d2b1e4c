#!/usr/bin/env bash
# Checks the style and types of the code, then runs the tests: ./test/run.sh [arguments of pytest]
#
# Has a ROS domain and a temporary folder of its own, and ends every process it started, however it
# ends.
set -euo pipefail
root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
cd "$root"
MAGLEV_SETUP=test . "$root/setup.sh"

workers=4  # files at a time

# Domains nobody else on this machine tests in, one for each worker: held by a lock on a file as long
# as this shell lives.
take_domain() {
  local locks=${XDG_RUNTIME_DIR:-/tmp}/maglev-domains-$UID number
  mkdir -p -- "$locks"
  for number in $(shuf -i "1-$((100 / workers))"); do
    exec 8>"$locks/$number"
    if flock -n 8; then
      export ROS_DOMAIN_ID=$number
      MAGLEV_TEST_DOMAINS=$(seq -s ' ' "$number" $((100 / workers)) 100)
      export MAGLEV_TEST_DOMAINS
      return
    fi
  done
  echo 'test: all ROS domains 1 to 100 are taken by other test runs' >&2
  exit 1
}

# Every process that carries this run's mark in its environment; this shell took it on too late for
# that.
started() {
  local file
  for file in $(env -u MAGLEV_TEST_RUN grep -lzxF "MAGLEV_TEST_RUN=$MAGLEV_TEST_RUN" \
    /proc/[0-9]*/environ 2>/dev/null); do
    file=${file#/proc/}
    echo "${file%/*}"
  done
}

end_started() {
  local pids signal _
  for signal in TERM KILL; do
    for _ in {1..20}; do
      pids=$(started)
      [[ -n $pids ]] || return 0
      # shellcheck disable=SC2086
      kill "-$signal" $pids 2>/dev/null || true
      sleep 0.1
    done
  done
}

finish() {
  trap '' INT TERM HUP
  [[ -z $style_job ]] || kill -- "-$style_job" 2>/dev/null || true
  end_started
  rm -rf -- "$TMPDIR"
}

# Does the same when this shell was killed and could not.
guard() {
  exec 8>&- >/dev/null 2>&1 </dev/null
  trap '' INT TERM HUP
  while kill -0 $$; do
    sleep 0.5
  done
  finish
}

tree_state() {
  git -C "$root" status --porcelain 2>/dev/null || true
}

check_style() {
  local failed=0
  ruff check . || failed=1
  ruff format --check . || failed=1
  mypy src/*/maglev_*/ scenarios/ benchmarks/ || failed=1
  return "$failed"
}

style_job=''
take_domain
TMPDIR=$(mktemp -d "${TMPDIR:-/tmp}/maglev-test.XXXXXX")
export TMPDIR MAGLEV_TEST_RUN=$TMPDIR ROS_LOG_DIR=$TMPDIR/ros
export ROS_PYTHON_CHECK_FIELDS=1 MPLBACKEND=Agg
export HYPOTHESIS_STORAGE_DIRECTORY=$TMPDIR/hypothesis
export RUFF_CACHE_DIR=$root/.cache/ruff MYPY_CACHE_DIR=$root/.cache/mypy
trap finish EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
trap 'exit 129' HUP
set -m
guard &
set +m
before=$(tree_state)

# In the background, so that a signal to this shell is seen at once; as jobs, so that the tests' own
# processes do not inherit an ignored SIGINT.
set -m
check_style >"$TMPDIR/style" 2>&1 8>&- &
style_job=$!
set +m

# Plugins: only ours, whatever else the machine has.
export PYTEST_DISABLE_PLUGIN_AUTOLOAD=1
bound=()
! command -v setpriv >/dev/null || bound=(setpriv --pdeathsig TERM)

run_pytest() { # ARGUMENT...
  set -m
  "${bound[@]}" python -m pytest -p hypothesispytest "$@" 8>&- &
  set +m
  wait $!
}

code=0
if (($#)); then
  run_pytest "$@" || code=$?
else
  # Several files at a time, for those with real nodes wait often, and a flight in lockstep bears
  # what the others take; then, with the machine to themselves, those that fly in real time.
  asked=${MAGLEV_LONG:+ or long}
  run_pytest -p xdist -n "$workers" --dist loadfile --no-loadscope-reorder \
    -m "not alone and (not long$asked)" || code=$?
  mapfile -t alone < <(grep -rlF mark.alone --include='test_*.py' test)
  run_pytest -m "alone and (not long$asked)" "${alone[@]}" || code=$?
fi
style=passed
wait "$style_job" || style=failed
style_job=''
cat -- "$TMPDIR/style"
end_started

if [[ $style == failed ]]; then
  echo 'test: ruff or mypy found something, see above' >&2
  code=$((code ? code : 1))
fi
if [[ $(tree_state) != "$before" ]]; then
  printf 'test: the run changed the tree:\n' >&2
  diff <(echo "$before") <(tree_state) >&2 || true
  code=$((code ? code : 1))
fi
exit "$code"
