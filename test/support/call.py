"""``call.py SERVICE[=true|false]...``: calls Triggers and SetBools in turn; a line an answer."""

from __future__ import annotations

import sys

from graph import Observer


def main(calls: list[str]) -> None:
    """Print ``yes`` or ``no`` and the message of each answer."""
    observer = Observer()
    for call in calls:
        service, equals, data = call.partition('=')
        answer = observer.call(service, data == 'true' if equals else None)
        print('yes' if answer.success else 'no', answer.message, flush=True)
    observer.close()


if __name__ == '__main__':
    main(sys.argv[1:])
