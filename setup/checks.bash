# shellcheck shell=bash
# What the set-up needs of the machine; each check ends it with one line that says what to do.

say() {
  printf 'setup: %s\n' "$*" >&2
}

fail() {
  say "$*"
  exit 1
}

fail_to_write() { # PATH
  fail "cannot write to $1: make it writable, or clone elsewhere"
}

# How this machine installs the packages named by their Debian and their Fedora names: "DEB..."
# "RPM..."
install_hint() {
  if command -v apt-get >/dev/null; then
    echo "sudo apt install $1"
  elif command -v dnf >/dev/null; then
    echo "sudo dnf install $2"
  else
    echo "install $1 (Debian's names) with your package manager"
  fi
}

# Sets branch (wheels or native), and for native ros_setup, the setup.bash of the ROS 2 Jazzy to
# use, and ros_prefix, where it lies. A ROS from wheels, of this or another clone, is not one to
# build on: it counts as none, also where it is gone since it was sourced.
choose_branch() {
  branch=native ros_prefix='' ros_setup=''
  local entry entries from_wheels=${_ROS_WHEELS_BOOTSTRAP_COMPLETE:-}
  if [[ -n ${ROS_DISTRO:-} && $ROS_DISTRO != jazzy ]]; then
    fail "ROS $ROS_DISTRO is sourced in this shell and this workspace is for ROS 2 Jazzy:" \
      'open a shell without it, or one with "source /opt/ros/jazzy/setup.bash"'
  fi
  if [[ -n ${ROS_DISTRO:-} ]]; then
    IFS=: read -ra entries <<<"${AMENT_PREFIX_PATH:-}"
    for entry in "${entries[@]}"; do
      if [[ $entry == "$venv" || -f $entry/.made-by-setup ]]; then
        from_wheels=yes
      elif [[ -f $entry/share/rclpy/package.xml ]]; then
        ros_prefix=$entry
        break
      fi
    done
    [[ -n $ros_prefix$from_wheels ]] || fail 'ROS 2 Jazzy is sourced in this shell but has no' \
      'rclpy: sudo apt install ros-jazzy-ros-base'
  fi
  if [[ -z $ros_prefix && -f /opt/ros/jazzy/setup.bash ]]; then
    ros_prefix=/opt/ros/jazzy
  elif [[ -z $ros_prefix ]]; then
    branch=wheels
    return
  fi
  for entry in "$ros_prefix" "${ros_prefix%/*}"; do # the second: ROS built from source, isolated
    if [[ -f $entry/setup.bash ]]; then
      ros_setup=$entry/setup.bash
      return
    fi
  done
  fail "ROS 2 Jazzy in $ros_prefix has no setup.bash: install it again"
}

check_place() {
  local LC_ALL=C
  [[ $root != *[^A-Za-z0-9._+@~/-]* ]] || fail "the folder '$root' has a sign in its name that ROS" \
    'cannot build with, it takes ASCII letters, digits and . _ - + @ ~: move it'
  ((${#root} <= 230)) || fail "the path of the folder '$root' is too long for programs in it to be" \
    "started, ${#root} signs and not 230 at most: move it"
  local place
  for place in "$root" "$root"/{.venv,.cache,build,install}; do
    [[ ! -e $place || -w $place ]] || fail_to_write "$place"
  done
  [[ ,$(findmnt -no OPTIONS -T "$root" 2>/dev/null), != *,noexec,* ]] ||
    fail "$root lies on a mount with noexec, where no program can be started: clone elsewhere"
  command -v flock >/dev/null || fail "flock is missing: $(install_hint util-linux util-linux-core)"
  [[ $branch == native ]] || check_wheels_machine
}

check_wheels_machine() {
  local machine libc
  machine="$(uname -s) $(uname -m)"
  [[ $machine == 'Linux x86_64' ]] || fail "this machine is $machine and there are ROS wheels" \
    'only for Linux x86_64: use Ubuntu 24.04 with ROS 2 Jazzy from apt, also in a container'
  libc=$(getconf GNU_LIBC_VERSION 2>/dev/null) || libc='no glibc'
  if [[ $libc != glibc* ||
    $(printf '%s\n' 2.28 "${libc#glibc }" | sort -V | head -n 1) != 2.28 ]]; then
    fail "this system has $libc and the ROS wheels need glibc 2.28 or later:" \
      'use a newer Linux, for instance Ubuntu 24.04'
  fi
}

# Sets python, the path of an interpreter that can carry the environment, and python_version.
check_python() {
  local name answer best='missing this machine has no Python'
  local names=(python3 /usr/bin/python3)
  # All on PATH: the first of a name may be a shim of pyenv for a version that is not there.
  [[ $1 != wheels ]] ||
    mapfile -t names < <(type -aP python3 python3.12 python3.11 python3.13 python3.10)
  for name in "${names[@]}"; do
    answer=$(PYTHONNOUSERSITE=1 bash -c "${ros_setup:+. $ros_setup >/dev/null; } exec \"\$@\"" - \
      "$name" "$root/setup/probe.py" "$1" 2>/dev/null) || continue
    if [[ $answer == 'ok '* ]]; then
      read -r _ python_version python <<<"$answer"
      return
    fi
    # Of several that cannot, the nearest to what is needed is the one to mend.
    [[ $best != missing* && $best != version* ]] || best=$answer
  done
  case $best in
    venv*) fail "${best#* }: $(install_hint "$(package_of "$best")-venv" python3)" ;;
    headers*) fail "${best#* }: $(install_hint "$(package_of "$best")-dev" python3-devel)" ;;
    rclpy*) fail "${best#* }: sudo apt install ros-jazzy-ros-base" ;;
    *) fail "${best#* } and this needs Python 3.10 to 3.13:" \
      "$(install_hint 'python3 python3-venv python3-dev' 'python3.12 python3.12-devel')" ;;
  esac
}

# 'venv Python 3.11 has no ...' -> python3.11
package_of() {
  local words
  read -ra words <<<"$1"
  echo "python${words[2]}"
}

# What the nodes and the build take from an installed ROS.
check_ros_packages() {
  local missing
  missing=$(bash -c '. "$0" >/dev/null
    for package; do
      found=
      for prefix in ${AMENT_PREFIX_PATH//:/ }; do
        [[ ! -f $prefix/share/$package/package.xml ]] || found=yes
      done
      [[ -n $found ]] || echo " ros-jazzy-${package//_/-}"
    done' "$ros_setup" rclpy std_msgs std_srvs diagnostic_msgs rcl_interfaces trajectory_msgs \
    geometry_msgs nav_msgs sensor_msgs visualization_msgs ament_cmake \
    rosidl_default_generators rosidl_default_runtime)
  [[ -z $missing ]] || fail "ROS 2 Jazzy lacks packages: sudo apt install${missing//$'\n'/}"
}

check_compiler() {
  local missing=() deb='' rpm=''
  local cxx=${CXX:-c++} cc=${CC:-cc} # with their own arguments, as in 'ccache g++'
  if ! command -v "${cxx%% *}" >/dev/null || ! command -v "${cc%% *}" >/dev/null; then
    missing+=('a C++ compiler') deb+=' g++' rpm+=' gcc-c++'
  fi
  command -v cmake >/dev/null || { missing+=(cmake) deb+=' cmake' rpm+=' cmake'; }
  command -v make >/dev/null || { missing+=(make) deb+=' make' rpm+=' make'; }
  if ((${#missing[@]})); then
    local text
    text=$(printf ' and %s' "${missing[@]}")
    fail "missing: ${text# and }: $(install_hint "${deb# }" "${rpm# }")"
  fi
}

# .venv is made anew when its stamp is wrong: only one that was made here may be.
check_own_venv() {
  [[ ! -e $venv || -f $venv/.made-by-setup || -z $(ls -A -- "$venv") ]] ||
    fail "there is a .venv in $root that setup.sh has not made: move it away, then run again"
}

check_space() { # MEGABYTES FOLDER
  local free
  free=$(df -Pm -- "$2" 2>/dev/null | awk 'NR == 2 { print $4 }') || return 0
  [[ ! $free =~ ^[0-9]+$ ]] || ((free >= $1)) ||
    fail "only $free MB are free where $2 lies and the set-up needs $1 MB: make room, run again"
}
