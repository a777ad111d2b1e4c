"""Say whether this interpreter can carry the environment: 'ok VERSION EXECUTABLE', or why not.

Runs under any Python 3 back to 3.6, so that one that is too old can be told so.
"""

import os
import platform
import sys
import sysconfig


def reason(branch: str) -> str:
    """Why this interpreter cannot be used, as 'KIND text'; empty when it can."""
    version = '{}.{}'.format(*sys.version_info[:2])
    if sys.version_info[:2] < (3, 10):  # noqa: UP036
        return f'version Python {version} is too old'
    if sys.version_info[:2] > (3, 13):
        return f'version Python {version} is too new'
    if branch == 'wheels' and platform.python_implementation() != 'CPython':
        return f'version {platform.python_implementation()} has no ROS wheels'
    if branch == 'wheels' and sysconfig.get_config_var('Py_GIL_DISABLED'):
        return f'version free-threaded Python {version} has no ROS wheels'
    try:
        import ensurepip  # noqa: F401
        import venv  # noqa: F401
    except ImportError:
        return f'venv Python {version} has no venv module'
    if not os.path.exists(os.path.join(sysconfig.get_paths()['include'], 'Python.h')):
        return f'headers Python {version} has no header files'
    if branch == 'native':
        try:
            import numpy  # noqa: F401
            import rclpy  # noqa: F401
        except ImportError as error:
            return f'rclpy Python {version} cannot import rclpy ({error})'
    return ''


def main() -> None:
    """Print the answer."""
    found = reason(sys.argv[1])
    if found:
        print(found)
    else:
        version = '{}.{}'.format(*sys.version_info[:2])
        print(f'ok {version} {os.path.realpath(sys.executable)}')


main()
