"""Who is silent, and what progress says."""

from __future__ import annotations

import numpy as np
import pytest

from maglev_model.contract.phases import Phase
from maglev_monitor.live.discovery import DiscoveryWatch
from maglev_monitor.live.progress import Progress
from maglev_monitor.live.silence import SilenceWatch
from maglev_monitor.metrics.joiner import ROW
from maglev_monitor.metrics.readable import angle_or_length, micro, seconds
from maglev_monitor.metrics.run_parameters import RunParameters

ALL = {'measurement': 1, 'currents': 1, 'reference': 1}


def test_the_first_to_fall_silent_is_blamed() -> None:
    watch = SilenceWatch(0.0)
    watch.update({'measurement': 10, 'currents': 10, 'reference': 50}, 1.0)
    watch.update({'measurement': 90, 'currents': 90, 'reference': 90}, 2.0)
    watch.update({'measurement': 95, 'currents': 95, 'reference': 90}, 3.0)
    watch.update({'measurement': 95, 'currents': 95, 'reference': 90}, 4.0)
    assert watch.longest(6.0) == ('reference', 4.0)
    assert watch.blame(ALL, 6.0) == 'the reference has been silent for 4.0 s, since sample 90'


def test_a_node_that_is_gone_is_named() -> None:
    watch = SilenceWatch(0.0)
    assert watch.blame({**ALL, 'currents': 0}, 1.0) == 'the controller is not running'
    missing = watch.blame({**ALL, 'currents': 0, 'measurement': 0}, 1.0)
    assert missing == 'the stage and the controller are not running'


def test_a_node_that_never_spoke_is_named() -> None:
    watch = SilenceWatch(0.0)
    watch.update({'measurement': 0, 'currents': -1, 'reference': 3}, 1.0)
    assert watch.blame(ALL, 2.0) == 'the controller never published a sample'


def test_a_broken_discovery_is_said_within_five_seconds_and_once() -> None:
    watch = DiscoveryWatch(7, '/', 10.0)
    watch.update([])
    said = [watch.warning(float(now)) for now in range(10, 20)]
    assert [bool(text) for text in said].index(True) < 5
    (warning,) = filter(None, said)
    for words in (
        'no node of the run is seen on domain 7. ',
        'ROS_DOMAIN_ID',
        'ROS_AUTOMATIC_DISCOVERY_RANGE',
        'loopback interface',
        'multicast',
        'VPN',
        'firewall',
        'FASTRTPS_DEFAULT_PROFILES_FILE',
    ):
        assert words in warning


def test_a_discovery_that_works_is_no_matter() -> None:
    watch = DiscoveryWatch(7, '/', 10.0)
    watch.update(['recorder'])
    watch.update([])
    assert watch.seen
    assert not any(watch.warning(float(now)) for now in range(10, 20))


def test_progress_line() -> None:
    rows = np.zeros(50, ROW)
    rows['has_reference'] = rows['has_plant'] = True
    rows['state'][:, 0] = 0.025 + np.tile([3e-6, -3e-6], 25)
    rows['reference'][:, 0] = 0.025
    progress = Progress(RunParameters())
    progress.add(rows)
    progress.line(1000, Phase.TRACK, 10.0)
    line = progress.line(4000, Phase.TRACK, 11.0)
    assert 't     4.00 s' in line
    assert '3.00 x' in line
    assert 'TRACK' in line
    assert 'y 3.0' in line
    assert progress.values()['mean_abs_error.y'] == '3.000e-06'
    assert '99' in progress.line(4000, 99, 12.0)


def test_progress_without_a_run_says_nothing_wrong() -> None:
    assert Progress(RunParameters()).line(-1, Phase.REST, 0.0).endswith('theta –')


@pytest.mark.parametrize(
    ('axis', 'value', 'text'),
    [
        ('y', 0.020, '20 mm'),
        ('y', 33e-6, '33 µm'),
        ('theta', 0.010, '10 mrad'),
        ('phi', 124e-6, '124 µrad'),
        ('x', 0.0, '0 mm'),
        ('x', -0.03, '-30 mm'),
    ],
)
def test_figures_as_people_read_them(axis: str, value: float, text: str) -> None:
    assert angle_or_length(axis, value) == text


def test_what_was_not_reached_is_said() -> None:
    assert seconds(None) == 'never'
    assert seconds(2.0) == '2.000 s'
    assert micro('x', -4e-8) == '0.0 µm'
    assert micro('y', None) == '–'
    assert micro('theta', 1e-5) == '10.0 µrad'
