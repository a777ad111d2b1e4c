"""``python scenarios NAME OPTION...``: what the scripts beside it call, after the set-up."""

import signal
import sys

signal.signal(signal.SIGINT, signal.SIG_DFL)  # until a run heeds it
signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})

from runner.commands import main  # noqa: E402

sys.exit(main(sys.argv[1:]))
