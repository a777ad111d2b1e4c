"""Trajectories given while the platen hovers: what they become, what is refused, and when."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from maglev_model.axes import AXES
from maglev_model.contract.modes import Mode
from maglev_model.contract.phases import Phase
from maglev_model.parameters import build
from maglev_reference.check import UnreachableError
from maglev_reference.given_points import Candidate, Point, Through, step
from maglev_reference.motion import Quintic, State
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.run import ReferenceRun

HOVER = np.array([0.025, 0.0, 0.0, 0.0, 0.0])
REST = np.array([0.031, 0.0, 0.0, 0.0, 0.0])
PARAMETERS = build(
    ReferenceParameters,
    {
        'trajectory': 'hold',
        'duration': 2.0,
        'run_in': 0.0,
        'move_time': 0.3,
        'lift_off.time': 0.5,
        'lift_off.settle': 0.1,
        'landing.time': 0.5,
    },
)
STEP = (Point(0.5, (0.01,)),)


def through(*points: Point, names: tuple[str, ...] = ('x',)) -> Through:
    return Through(names, points, HOVER)


def test_a_point_alone_is_a_move_from_rest_to_rest() -> None:
    motion = through(Point(0.5, (0.01, 0.026)), names=('x', 'y'))
    assert motion.length == 0.5
    moved = motion.evaluate(np.array([0.0, 0.25, 0.5, 0.6]))
    np.testing.assert_allclose(moved.position[:, 1], [0.0, 0.005, 0.01, 0.01], atol=1e-12)
    np.testing.assert_allclose(moved.position[:, 0], [0.025, 0.0255, 0.026, 0.026], atol=1e-12)
    np.testing.assert_array_equal(moved.position[:, 2:], 0.0)
    np.testing.assert_allclose(moved.velocity[[0, 2, 3]], 0.0, atol=1e-12)
    np.testing.assert_allclose(moved.acceleration[[0, 2, 3]], 0.0, atol=1e-9)


def test_points_with_velocities_are_joined_by_cubics() -> None:
    """A cubic that is sampled comes back."""
    knots = np.linspace(0.0, 1.0, 5)
    position, velocity = 0.01 * knots**2 * (3.0 - 2.0 * knots), 0.06 * knots * (1.0 - knots)
    points = [Point(t, (p,), (v,)) for t, p, v in zip(knots, position, velocity, strict=True)][1:]
    time = np.linspace(0.0, 1.0, 101)
    moved = through(*points).evaluate(time)
    inside = time > knots[1]  # before that its acceleration begins at 0
    cubic = 0.01 * time**2 * (3.0 - 2.0 * time)
    np.testing.assert_allclose(moved.position[inside, 1], cubic[inside], atol=1e-12)
    assert moved.acceleration[0, 1] == 0.0
    np.testing.assert_allclose(moved.acceleration[inside, 1], 0.06 - 0.12 * time[inside], atol=1e-9)


def test_accelerations_are_met_and_a_first_point_may_be_the_hover() -> None:
    motion = through(
        Point(0.0, (0.0,)), Point(0.2, (0.001,), (0.02,), (0.1,)), Point(0.5, (0.004,))
    )
    moved = motion.evaluate(np.array([0.2]))
    assert moved.position[0, 1] == pytest.approx(0.001)
    assert moved.velocity[0, 1] == pytest.approx(0.02)
    assert moved.acceleration[0, 1] == pytest.approx(0.1)
    before = motion.evaluate(np.array([0.2 - 1e-9]))
    assert before.acceleration[0, 1] == pytest.approx(0.1, abs=1e-5)


def test_each_piece_of_many_is_the_quintic_between_its_ends() -> None:
    rng = np.random.default_rng(5)
    states = [State.at_rest(HOVER)]
    states += [State(*(HOVER + 1e-3 * rng.normal(size=5) for _ in range(3))) for _ in range(40)]
    states += [State.at_rest(HOVER)]
    times = np.concatenate(([0.0], np.cumsum(rng.uniform(0.01, 0.3, len(states) - 1))))
    points = [Point(t, *map(tuple, state)) for t, state in zip(times, states, strict=True)]
    motion = through(*points, names=AXES)
    for number, pair in enumerate(itertools.pairwise(states)):
        length = times[number + 1] - times[number]
        alone = np.linspace(0.0, length, 7)[:-1]
        piece = Quintic(*pair, length).evaluate(alone)
        for whole, part in zip(motion.evaluate(times[number] + alone), piece, strict=True):
            np.testing.assert_allclose(whole, part, rtol=1e-9, atol=1e-9)


def test_a_first_point_at_the_hover_changes_nothing() -> None:
    """Its velocities are 0 and its accelerations, which no one gives, are too."""
    rest = Point(0.4, (0.001,), (0.0,))
    with_it, alone = through(Point(0.0, (5e-7,), (0.0,)), rest), through(rest)
    for one, other in zip(
        *(m.evaluate(np.linspace(0.0, 0.5, 11)) for m in (with_it, alone)), strict=True
    ):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ('names', 'points', 'why'),
    [
        (('w',), STEP, "there is no axis 'w', there are y, x, z, phi, theta"),
        (('x', 'x'), STEP, 'name each axis once'),
        ((), STEP, 'at least one'),
        (('x',), (), 'no points'),
        (('x', 'z'), STEP, r'point 1, at 0\.5 s, has 1 values of position for 2 axes'),
        (('x',), (Point(0.5, (0.0,), (0.0, 0.0)),), 'has 2 values of velocity for 1 axes'),
        (('x',), (Point(0.5, (math.nan,)),), r'position of x is nan at 0\.5 s'),
        (('x',), (Point(math.nan, (0.0,)),), 'point 1 is at nan s'),
        (('x',), (Point(5e8, (0.0,)),), r'point 1 is at 5e\+08 s, it must lie in \[0, 36000\] s'),
        (('x',), (Point(0.0, (0.0,)), *STEP, *STEP), r'point 3 is at 0\.5 s, .* after 0\.5 s'),
        (('x',), (Point(0.0, (0.0,)), Point(0.0, (0.0,))), r'point 2 is at 0 s, .* after 0 s'),
        (('x',), (*STEP, Point(0.5, (0.0,))), r'point 2 is at 0\.5 s, it must come after 0\.5 s'),
        (('x',), (Point(0.0, (0.001,)), *STEP), r'x is 0\.001 m at 0 s, .* hovers, at 0 m'),
        (('x',), (Point(0.0, (0.0,)),), 'no point after its start'),
        (('x',), (Point(0.0, (0.0,), (0.1,)), *STEP), 'velocity of x is 0.1 at 0 s, not 0'),
        (('x',), (Point(0.5, (0.0,), (0.1,)),), r'velocity of x is 0\.1 at 0\.5 s, .* end at rest'),
    ],
)
def test_what_is_no_motion(names: tuple[str, ...], points: tuple[Point, ...], why: str) -> None:
    with pytest.raises(UnreachableError, match=why):
        Through(names, points, HOVER)


def checked(motion: Through) -> int:
    """How many pieces it takes."""
    candidate, pieces = Candidate(motion, HOVER, PARAMETERS), 1
    while not candidate.check():
        pieces += 1
    return pieces


@pytest.mark.parametrize(
    ('point', 'why'),
    [
        (Point(3.0, (0.06,)), r'x is 0\.0\d+ m at \d\.\d+ s, it must lie in'),
        (Point(0.05, (0.03,)), r'the (speed|acceleration) of x is .* at 0\.0\d+ s'),
    ],
)
def test_it_is_checked_as_any_reference_is(point: Point, why: str) -> None:
    with pytest.raises(UnreachableError, match=why):
        checked(through(point))
    assert checked(through(Point(3.0, (0.03,)))) == 3


def test_what_jumps_between_two_samples_is_refused() -> None:
    with pytest.raises(UnreachableError, match=r'x moves by 0\.0009 m .* its velocity makes 0 m'):
        checked(through(Point(0.1000002, (0.0,)), Point(0.1000004, (0.0009,))))


def test_a_step_is_a_shaped_one() -> None:
    """As steps.* and limits.* say: 0.2 s, and longer where the acceleration would be too large."""
    motion = step('theta', -0.002, HOVER, PARAMETERS)
    assert motion.length == 0.2
    end = motion.evaluate(np.array([0.2])).position[0]
    np.testing.assert_allclose(end, [0.025, 0.0, 0.0, 0.0, -0.002], atol=1e-15)
    longer = step('x', 0.05, HOVER, PARAMETERS)
    assert longer.length == pytest.approx(math.sqrt(10.0 / math.sqrt(3.0) * 0.05 / 5.5))
    assert checked(longer) == 1


@pytest.mark.parametrize(
    ('axis', 'distance', 'why'),
    [
        ('w', 0.001, "there is no axis 'w'"),
        ('y', -0.0101, r'y shall step by -0\.0101 m, it may by 0\.01 m \(limits\.step\)'),
        ('phi', math.nan, 'phi shall step by nan rad'),
        ('y', -0.008, r'y is 0\.017\d+ m at 0\.\d+ s, it must lie in'),
    ],
)
def test_a_step_that_is_refused(axis: str, distance: float, why: str) -> None:
    with pytest.raises(UnreachableError, match=why):
        checked(step(axis, distance, HOVER, PARAMETERS))


def hovering(lead: int = 64) -> ReferenceRun:
    """A run that hovers in TRACK."""
    run = ReferenceRun(PARAMETERS, lead, True)
    run.observe(0)
    run.start(run.plan(REST))
    run.observe_controller(Mode.REGULATING, 0)
    while run.phase != Phase.TRACK:
        advance(run)
    return run


def advance(run: ReferenceRun, count: int = 20) -> None:
    run.observe(run.newest + count)
    run.due()
    run.enter_phase()


def followed(run: ReferenceRun) -> float:
    """The length of what was proposed, when it is followed."""
    while True:
        length = run.consider()
        if length is not None:
            return length
        advance(run)


def test_it_is_followed_from_the_hover_and_hovers_where_it_ends() -> None:
    run = hovering()
    run.propose(('x',), (Point(1.5, (0.01,)),))
    assert followed(run) == 1.5
    first, block = run.newest + run.ahead + 1, None
    positions = []
    while run.newest < first + 4000:
        run.observe(run.newest + 20)
        block = run.due()
        if block is not None:
            positions.append(block[1].position)
        run.enter_phase()
        run.give_way()
    x = np.concatenate(positions)[:, 1]
    assert np.abs(np.diff(x)).max() < 2e-5
    assert x[-1] == pytest.approx(0.01)
    assert run.phase == Phase.HOLD
    assert not run.grounded
    assert not run.idle
    assert not run.over
    run.propose(('x', 'y'), (Point(0.5, (0.0, 0.024)),))
    assert followed(run) == 0.5
    for _ in range(50):
        advance(run)
    assert run.land()
    for _ in range(200):
        advance(run)
    assert run.phase == Phase.END


@pytest.mark.parametrize('length', [0.0103, 0.0107])
def test_it_arrives_also_between_two_samples(length: float) -> None:
    run = hovering()
    run.propose(('x',), (Point(length, (1e-4,), (0.0,)),))
    assert followed(run) == length
    end = run.newest + run.ahead + 1 + 11
    while run.newest + run.ahead < end:
        run.observe(run.newest + 1)
        due = run.due()
    assert due is not None
    assert due[0] <= end
    assert due[1].position[end - due[0], 1] == 1e-4
    assert not due[1].velocity[end - due[0]].any()


def test_where_nothing_hovers_it_is_refused() -> None:
    run = ReferenceRun(PARAMETERS, 64, True)
    with pytest.raises(UnreachableError, match='there is no stage'):
        run.propose(('x',), STEP)
    run.observe(0)
    run.start(run.plan(REST))
    run.observe_controller(Mode.REGULATING, 0)
    with pytest.raises(UnreachableError, match='does not hover'):
        run.propose(('x',), STEP)
    run = hovering()
    run.propose(('x',), STEP)
    followed(run)
    advance(run, 100)
    with pytest.raises(UnreachableError, match='does not hover'):
        run.propose(('x',), STEP)


def test_a_hover_that_ends_while_it_is_checked() -> None:
    run = hovering()
    run.propose(('x',), (Point(5.0, (0.01,)),))
    assert run.consider() is None
    run.land()
    with pytest.raises(UnreachableError, match='does not hover'):
        followed(run)
    assert run.consider() is None


def test_a_refused_one_changes_nothing() -> None:
    run, other = hovering(), hovering()
    run.propose(('x',), (Point(0.5, (0.06,)),))
    with pytest.raises(UnreachableError, match='x is'):
        followed(run)
    for _ in range(10):
        run.observe(run.newest + 20)
        other.observe(other.newest + 20)
        np.testing.assert_array_equal(run.due()[1].position, other.due()[1].position)  # type: ignore[index]


def test_a_controller_that_lands_takes_the_hover_away() -> None:
    run = hovering()
    run.propose(('x',), STEP)
    followed(run)
    for _ in range(60):
        advance(run)
    run.observe_controller(Mode.LANDING, run.newest)
    assert run.give_way() == 'the controller lands by itself'
    with pytest.raises(UnreachableError, match='the controller lands by itself'):
        run.propose(('x',), STEP)
