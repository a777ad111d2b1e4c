"""``call.py SERVICE [true|false]``: calls a Trigger, or a SetBool; 0 when it succeeds."""

from __future__ import annotations

import sys

from graph import Observer


def main(service: str, data: str = '') -> int:
    """Call it and print its message."""
    observer = Observer()
    answer = observer.call(service, data == 'true' if data else None)
    print(answer.message)
    observer.close()
    return 0 if answer.success else 1


if __name__ == '__main__':
    sys.exit(main(*sys.argv[1:]))
