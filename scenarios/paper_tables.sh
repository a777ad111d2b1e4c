#!/bin/sh
# Twelve runs, one after another, each as its own scenario; then the page. See --help.
exec bash -p "$(dirname -- "$(readlink -f -- "$0")")/start.bash" paper_tables "$@"
