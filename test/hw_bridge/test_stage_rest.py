"""When the stage takes a platen to rest, to have left its stop, or to slide: at the bounds."""

from __future__ import annotations

import numpy as np
import pytest
from made_up import LOWER_STOP, active, watched

from maglev_hw_bridge.sensing.guard_arrays import LOST
from maglev_hw_bridge.stage import BridgeStage, Mode


@pytest.mark.parametrize(
    ('above', 'rate', 'rests'),
    [
        (1.7e-5, 0.0, True),
        (1.8e-5, 0.0, False),
        (1.9e-5, 0.0, False),
        (0.0, 0.99e-2, True),
        (0.0, -0.99e-2, True),
        (0.0, 1e-2, False),
        (0.0, 1.01e-2, False),
        (0.0, -1.01e-2, False),
    ],
)
def test_nearer_than_18_um_and_slower_than_a_count_in_a_sample_it_rests(
    above: float, rate: float, *, rests: bool
) -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP - above, rate)
    assert stage._touches() == stage._on_the_stop() == rests
    watched(stage, LOWER_STOP - 1e-3, rate)
    stage.guard.arrays.believed[:] = [LOWER_STOP] * 4 + [0.0, 0.0]
    stage.guard.arrays.believed[2] = LOWER_STOP - above
    assert not stage._touches()
    assert stage._on_the_stop() == rests, 'all four have to be there'


@pytest.mark.parametrize(('above', 'near'), [(1.99e-4, True), (2.01e-4, False)])
def test_where_it_has_not_moved_for_a_tenth_of_a_second_near_its_stop_it_rests(
    above: float, *, near: bool
) -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP - above)
    stage._still_at = LOWER_STOP - above + 1.9e-5
    for sample in range(1, 101):
        stage._look_for_rest()
        assert stage._still_samples == (sample if near else 0)
        assert stage._on_the_stop() == (near and sample >= 100)


@pytest.mark.parametrize(('step', 'moved'), [(1.99e-5, False), (2.01e-5, True)])
def test_what_moves_by_two_counts_does_not_stand_still(step: float, *, moved: bool) -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP - 1e-4)
    stage._look_for_rest()
    for sample in range(50):
        stage._look_for_rest()
        assert stage._still_samples == sample + 1
    for _ in range(2):  # from where it stood, not from a sample ago
        stage.guard.arrays.position[0] -= 0.5 * step
        stage._look_for_rest()
    assert stage._still_samples == (0 if moved else 52)


@pytest.mark.parametrize('samples', [1, 2])
def test_it_has_rested_only_in_this_life(samples: int) -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    stage.guard.arrays.samples = samples
    stage._look_for_rest()
    assert stage._rests == (samples > 1)


def test_what_flew_has_to_rest_anew() -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    stage._look_for_rest()
    assert stage._rests
    stage.flying = True
    stage._look_for_rest()
    assert not stage._rests


@pytest.mark.parametrize(
    ('corner', 'y_rate', 'tilt_rate', 'left'),
    [
        (2.99e-4, 0.0, 0.0, False),
        (3.01e-4, 0.0, 0.0, True),
        (2.99e-4, 0.1, 0.0, False),  # down, it will not lift,
        (3.01e-4, 0.1, 0.0, True),  # but has
        (0.0, -1.49e-2, 0.0, False),
        (0.0, -1.51e-2, 0.0, True),
        (0.0, 0.0, 0.149, False),
        (0.0, 0.0, -0.149, False),
        (0.0, 0.0, 0.151, True),
        (0.0, 0.0, -0.151, True),
        (1.0e-4, -0.99e-2, 0.0, False),
        (1.0e-4, -1.01e-2, 0.0, True),
    ],
)
@pytest.mark.parametrize('axis', [3, 4])
def test_a_corner_that_is_or_will_soon_be_0_3_mm_off_has_left(
    axis: int, corner: float, y_rate: float, tilt_rate: float, *, left: bool
) -> None:
    stage, _ = active()
    scale = 0.1 / stage.parameters.machine.radius
    for gap in range(4):
        watched(stage, LOWER_STOP, y_rate)
        stage.guard.arrays.rate[axis] = scale * tilt_rate
        stage.guard.arrays.length[gap] = LOWER_STOP - corner
        assert stage._leaves() == left


@pytest.mark.parametrize(('axis', 'rises'), [(3, 0), (4, 3)])
@pytest.mark.parametrize('way', [1.0, -1.0])
def test_which_corner_a_tilt_lifts(way: float, axis: int, rises: int) -> None:
    """A gap of phi is smaller at motor 1, of theta at motor 4, and stays at the other two."""
    stage, _ = active()
    opposite = (rises + 2) % 4
    for gap in range(4):
        watched(stage, LOWER_STOP)
        stage.guard.arrays.rate[axis] = way * 0.014 / stage.parameters.machine.radius
        stage.guard.arrays.length[gap] = LOWER_STOP - 2.9e-4
        assert stage._leaves() == (gap == (rises if way > 0.0 else opposite))


def test_only_an_active_stage_is_left_unbidden() -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    stage._look_for_rest()
    stage.land('for a test')
    assert stage.mode is Mode.DISABLED
    watched(stage, LOWER_STOP - 1e-3)
    stage._look_for_rest()
    assert stage.fault is None
    stage.resume()
    stage._look_for_rest()
    assert stage.fault is not None
    assert stage.fault.kind == 'current'


@pytest.mark.parametrize(
    ('parked', 'away', 'slides'),
    [(98, 3.5e-4, False), (99, 3.5e-4, True), (99, 2.99e-4, False), (150, 3.01e-4, True)],
)
@pytest.mark.parametrize('axis', [1, 2])
@pytest.mark.parametrize('way', [-1.0, 1.0])
def test_what_was_parked_for_a_tenth_of_a_second_and_is_0_3_mm_off_slides(
    way: float, axis: int, parked: int, away: float, *, slides: bool
) -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    place = stage.guard.arrays.position
    place[axis] = -3e-3
    for _ in range(parked + 1):  # the first is a leap to there
        assert not stage._slides()
    found = []
    steps = 5  # none is a leap, and after the first of them it still is parked
    for k in range(1, steps + 1):
        place[axis] = -3e-3 + way * away * k / steps
        found.append(stage._slides())
    assert any(found) == slides
    assert found[-1] == slides


def test_what_slides_has_amplifiers_that_are_on() -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    for k in range(160):
        stage.guard.arrays.position[1] = 5e-5 * max(k - 120, 0)
        stage._look_for_rest()
    assert stage.fault is not None
    assert stage.fault.kind == 'current'
    assert 'slid' in stage.fault.reason


@pytest.mark.parametrize('period', [1e-3, 5e-3])
@pytest.mark.parametrize(('speed', 'leaps'), [(0.099, False), (0.101, True)])
def test_what_leaps_in_a_sample_has_not_slid(speed: float, period: float, *, leaps: bool) -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    stage.sample_time, stage.guard.arrays.samples, step = period, 10, speed * period
    for _ in range(120):
        stage._slides()
    found = []
    for k in range(1, 5):
        stage.guard.arrays.position[1] = step * k
        found.append(stage._slides())
    assert any(found) == (not leaps)


@pytest.mark.parametrize(('away', 'stays'), [(0.99e-4, True), (1.01e-4, False)])
def test_before_it_is_parked_it_may_not_move_by_a_tenth_of_a_millimetre(
    away: float, *, stays: bool
) -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    for _ in range(60):
        stage._slides()
    for k in range(1, 4):
        stage.guard.arrays.position[2] = away * k / 3
        stage._slides()
    assert stage._parked_samples == (63 if stays else 0)


def test_what_flies_is_not_parked() -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    for _ in range(120):
        stage._slides()
    stage.flying = True
    assert not stage._slides()
    assert stage._parked_samples == 0


def at(stage: BridgeStage, height: float) -> None:
    """Have a stage whose lower stop is so far from 0 watch a platen at 0, where that is exact."""
    stage._lower_stop = height
    watched(stage, 0.0)


def test_exactly_at_a_bound_it_neither_rests_nor_has_it_left() -> None:
    stage, _ = active()
    at(stage, 2e-4)
    stage._look_for_rest()
    assert stage._still_samples == 0
    at(stage, np.nextafter(2e-4, 0.0))
    stage._look_for_rest()
    assert stage._still_samples == 1
    stage._still_at = 2e-5
    stage._look_for_rest()
    assert stage._still_samples == 0
    at(stage, 3e-4)
    assert not stage._leaves()
    at(stage, np.nextafter(3e-4, 1.0))
    assert stage._leaves()


def test_exactly_at_a_bound_it_has_not_slid_nor_leapt_nor_parked() -> None:
    stage, _ = active()
    watched(stage, LOWER_STOP)
    place = stage.guard.arrays.position
    stage._parked_samples, place[1] = 99, 1e-4
    stage._was_at[0] = 5e-5
    assert not stage._slides()
    assert stage._parked_samples == 0  # it was not parked yet, and is too far for that
    stage._parked_samples, stage._parked_at[0] = 100, 0.0
    stage._was_at[0], place[1] = 2.5e-4, 3e-4
    assert not stage._slides()
    stage._was_at[0] = place[1] = 0.0
    stage._parked_samples = 100
    place[1] = 1e-4
    assert not stage._slides()
    assert stage._parked_samples == 101  # so far in a sample is no leap


def zeros(
    stage: BridgeStage, y: float, above: list[float], still: list[int], lost: tuple[int, ...] = ()
) -> str:
    """What comes of no current so far above the lower stop [m]; of gaps, too, and their samples."""
    watched(stage, LOWER_STOP - y)
    stage.flying = True
    state = stage.guard.arrays
    state.believed[:4] = LOWER_STOP - np.array(above)
    state.still[:] = still
    state.trust[list(lost)] = LOST
    stage.write(np.zeros(4), np.zeros(4))
    assert stage.fault is not None
    return stage.fault.kind


@pytest.mark.parametrize(
    ('y', 'above', 'still', 'kind'),
    [
        (5e-5, [0.0, 2.6e-5, 0.0, 2.3e-4], 100, 'encoder'),
        (1.99e-4, [1.7e-5, 1.2e-4, 0.0, 1.2e-4], 300, 'encoder'),
        (2.01e-4, [1.7e-5, 1.2e-4, 0.0, 1.2e-4], 300, 'controller'),
        (5e-5, [0.0, 2.6e-5, 0.0, 2.3e-4], 99, 'controller'),
        (5e-5, [0.0, 2.4e-5, 0.0, 2.3e-4], 300, 'controller'),
        (5e-5, [1.9e-5, 1.2e-4, 0.0, 1.2e-4], 300, 'controller'),
        (5e-5, [1.2e-4, 1.2e-4, 1.2e-4, 1.2e-4], 300, 'controller'),
    ],
)
def test_gaps_that_hang_above_the_stop_when_a_landing_is_over_are_stuck(
    y: float, above: list[float], still: int, kind: str
) -> None:
    stage, _ = active()
    assert zeros(stage, y, above, [10, still, 10, still]) == kind
    assert stage.guard.failed == ([1, 3] if kind == 'encoder' else [])
    assert stage.fault is not None
    assert ('encoder gap 2, gap 4 is stuck' in stage.fault.reason) == (kind == 'encoder')


def test_one_that_hangs_is_landed_without() -> None:
    stage, _ = active()
    assert zeros(stage, 5e-5, [0.0, 0.0, 2e-4, 0.0], [200, 200, 300, 200]) == 'encoder'
    assert stage.guard.blamed == [2]
    assert stage.mode is Mode.LANDING


def test_of_neighbours_that_hang_the_platen_is_let_go() -> None:
    stage, _ = active()
    assert zeros(stage, 5e-5, [0.0, 0.0, 2e-4, 2e-4], [200, 200, 300, 300]) == 'encoder'
    assert stage.mode is Mode.DISABLED


def test_what_is_done_without_neither_hangs_nor_rests() -> None:
    stage, _ = active()
    above = [0.0, 2e-4, 2e-4, 0.0]
    assert zeros(stage, 5e-5, above, [200, 200, 300, 200], lost=(0, 1)) == 'encoder'
    assert stage.guard.blamed == [2]
    stage, _ = active()
    assert zeros(stage, 5e-5, above, [200, 200, 300, 200], lost=(0, 3)) == 'controller'
