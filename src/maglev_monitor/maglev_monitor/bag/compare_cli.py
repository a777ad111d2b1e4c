"""``compare_bags A B``: whether two runs are the same, sample by sample. No ROS here."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NoReturn

from maglev_model.contract.wire import TOPIC_TYPES
from maglev_model.programs.arguments import not_negative
from maglev_model.programs.command import leave_with
from maglev_model.programs.progress import Progress
from maglev_monitor.bag.compare import TopicComparison, compare
from maglev_monitor.bag.errors import BagError, refuse
from maglev_monitor.bag.reader import Bag

EQUAL, DIFFERENT, UNREADABLE = 0, 1, 2


def compare_bags(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code.

    0: what was compared is equal; 1: it is not; 2: a bag cannot be read, or there is nothing to
    compare.
    """
    options = _parser().parse_args(arguments)
    try:
        progress = Progress('compare_bags', '%', lines=False)  # of one: both are read in step
        bags = (Bag(options.first, progress), Bag(options.second))
        comparisons = compare(
            bags, options.topics, tolerance=options.tolerance, wall_clock=options.wall_clock
        )
        lost = [key for key in options.topics if key not in comparisons]
        if not comparisons or (lost and options.topics is not _ALL):
            raise BagError(f"neither bag holds '{', '.join(lost)}'")
    except BagError as error:
        return refuse('compare_bags', error, UNREADABLE)
    for bag in bags:
        for note in bag.notes:
            print(f'compare_bags: {bag.path}: {note}', file=sys.stderr)
    for key, topic in comparisons.items():
        print('\n'.join(_lines(key, topic, options.tolerance)))
    equal = all(topic.equal for topic in comparisons.values())
    print('equal' if equal else 'different')
    return EQUAL if equal else DIFFERENT


def main() -> NoReturn:
    """Entry point of the executable."""
    leave_with(compare_bags)


_ALL = tuple(TOPIC_TYPES)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='compare_bags',
        description='Compare the samples of two runs, up to the end of the run.',
    )
    for name in ('first', 'second'):
        parser.add_argument(
            name, type=Path, metavar='BAG', help="a run's folder, a bag, or a bag's file"
        )
    parser.add_argument(
        '--topics',
        nargs='+',
        choices=_ALL,
        default=_ALL,
        metavar='TOPIC',
        help=f'some of {", ".join(_ALL)} (default: all)',
    )
    parser.add_argument(
        '--tolerance',
        type=not_negative,
        default=0.0,
        metavar='X',
        help='differences up to this are none, in SI units (default: 0, bit by bit)',
    )
    parser.add_argument(
        '--wall-clock', action='store_true', help='compare stamps and late samples too'
    )
    return parser


def _lines(key: str, topic: TopicComparison, tolerance: float) -> Iterator[str]:
    only = ', '.join(
        f'{len(numbers)} only in {name} from sample {min(numbers)} on'
        for name, numbers in zip(('the first', 'the second'), topic.only, strict=True)
        if numbers
    )
    same = 'equal bit by bit' if tolerance == 0.0 else f'equal within {tolerance:g}'
    verdict = f'{len(topic.differences)} fields differ' if topic.differences else same
    yield f'{key}: {topic.both} samples in both{", " + only if only else ""}: {verdict}'
    for names, side in zip(topic.fields, ('the first', 'the second'), strict=True):
        if names:
            yield f'  not compared, for only {side} has it: {", ".join(sorted(names))}'
    for name, field in topic.differences.items():
        yield (
            f'  {name}: {field.samples} samples differ, first {field.first},'
            f' at most by {field.largest:.3g}'
        )
