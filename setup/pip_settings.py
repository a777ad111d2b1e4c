"""Say which of the caller's pip settings lead to packages: NAME=VALUE for an environment, each
ended by a zero byte.

All others, such as a target or a prefix, are for what he installs himself.
"""

import ast
import os
import subprocess
import sys

LEADING = (
    *('index-url', 'extra-index-url', 'find-links', 'no-index', 'trusted-host', 'proxy'),
    *('cert', 'client-cert', 'keyring-provider', 'timeout', 'default-timeout'),
    *('cache-dir', 'no-cache-dir'),
)
SECTIONS = ('global', 'install', ':env:')  # the later ones win
HIDING = ('QUIET', 'USER', 'GLOBAL', 'SITE')  # which, set for all commands, narrow that list


def main() -> None:
    """Ask pip, and print."""
    listed = subprocess.run(
        [sys.executable, '-m', 'pip', 'config', 'list'],
        env={**os.environ, **{f'PIP_{name}': '0' for name in HIDING}},
        stdout=subprocess.PIPE,
        check=True,
    )
    for section in SECTIONS:
        for line in listed.stdout.decode().splitlines():
            name, _, value = line.partition('=')
            where, _, key = name.partition('.')
            if where == section and key in LEADING:
                variable = 'PIP_' + key.upper().replace('-', '_')
                sys.stdout.write(f'{variable}={ast.literal_eval(value)}\0')


main()
