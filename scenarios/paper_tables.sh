#!/usr/bin/env bash
# Twelve runs, one after another, each as its own scenario; then the page. See --help.
. "$(dirname -- "${BASH_SOURCE[0]}")/start.bash" paper_tables "$@"
