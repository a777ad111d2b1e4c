"""``tune``: bandwidth, integration and learning of each axis that serve the worst machines best.

Those of ``robustness``, without ROS. What is found is printed as a file of parameters, with how it
does on machines that it was not tuned on.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NoReturn

from maglev_model.programs.arguments import not_negative, whole_number
from maglev_model.programs.command import leave_with
from maglev_model.programs.progress import Progress
from maglev_study.command import DONE, INTERRUPTED, command
from maglev_study.robustness.main import command_parser, plan_of

if TYPE_CHECKING:
    from maglev_study.robustness.tune import Trial, Tuned

NO_BETTER = 1


def main() -> NoReturn:
    """Entry point of the executable."""
    leave_with(run)


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code.

    0: what was found is better on some axis and worse on none; 1: it is not; 2: wrong use, or a
    library is missing; 130: interrupted before that was known, what was found is kept.
    """
    return command('tune', _parser().parse_args(arguments), _tuned)


def _tuned(options: argparse.Namespace) -> tuple[int, dict[str, Any]]:
    from maglev_study.robustness.tune import tune

    plan = plan_of(options, [options.law])
    progress = Progress('tune', 'tried')

    def heard(done: int, trial: Trial) -> None:
        worst = ' '.join(f'{one:.2f}' for one in trial.worst)
        progress.tell(done, options.trials, f', worst machines by axis {worst}')

    found = tune(
        plan,
        options.trials,
        options.margin,
        jobs=options.jobs,
        scheduler=options.scheduler,
        heard=heard,
    )
    progress.end()
    text = render(found, options.machines, options.seed)
    (options.out / 'tuned.yaml').write_text(text, encoding='utf-8')
    print(text, end='')
    code = INTERRUPTED if found.fresh is None else DONE if better(found) else NO_BETTER
    return code, {'numbers': found.numbers}


def better(found: Tuned) -> bool:
    """Whether the worst machines of a fresh seed fly better on some axis, and no worse on any."""
    if found.fresh is None:
        return False
    default, best = found.fresh
    change = best.worst - default.worst
    return bool((change <= 0.0).all() and (change < 0.0).any())


def render(found: Tuned, machines: int, seed: int) -> str:
    """The file of parameters, which says how it was found and how it does."""
    from maglev_model.axes import AXES

    verdict = 'beats' if better(found) else 'does NOT beat' if found.fresh else 'NOT compared with'
    lines = [
        f'# Tuned on {machines} machines of seed {seed}; {verdict} the numbers as they were on as',
        f'# many of seed {seed + 1}. Guaranteed at 25 mm, in all currents at once: '
        f'±{found.gain:.1f} dB.',
    ]
    if found.fresh:
        default, best = found.fresh
        lines.append('# Mean error of the worst five per cent, by the nominal one: before, after')
        each = zip(AXES, default.worst, best.worst, strict=True)
        lines += [f'#   {axis:6}{before:8.3f}{after:8.3f}' for axis, before, after in each]
    lines += ['controller:', '  ros__parameters:']
    for axis, numbers in found.numbers.items():
        told = ', '.join(f'{name}: {value:.1f}' for name, value in numbers.items())
        lines.append(f'    {axis}: {{{told}}}')
    return '\n'.join(lines) + '\n'


def _parser() -> argparse.ArgumentParser:
    parser = command_parser('tune', __doc__, machines=40)
    add = parser.add_argument
    add('--trials', type=whole_number(1, 10**5), default=60, metavar='N', help='how many')
    add('--margin', type=not_negative, default=6.0, metavar='DB', help='guaranteed in all currents')
    add('--law', default='default', metavar='NAME', help='the law that is tuned')
    return parser


if __name__ == '__main__':
    main()
