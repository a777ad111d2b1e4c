"""The figures of a run: against plain NumPy over the whole run."""

from __future__ import annotations

import copy
import json
from typing import Any

import numpy as np
import pytest
from made_up_run import OWN, TOPICS, Encoder, make_run
from run_figures import RUN, figures

from maglev_model.axes import AXES
from maglev_model.contract.modes import Mode
from maglev_model.contract.phases import Phase
from maglev_model.parameters import build
from maglev_monitor.metrics.decoding import Records, decode
from maglev_monitor.metrics.derived import phase_currents
from maglev_monitor.metrics.joiner import ROW, Joiner
from maglev_monitor.metrics.run_metrics import RunMetrics
from maglev_monitor.metrics.run_parameters import RunParameters
from maglev_monitor.report.terminal import as_text


def test_tracking_errors(run: Any, records: dict[str, Records]) -> None:
    found = figures(records)
    error = (run.position - run.reference)[run.phase == Phase.TRACK]
    for index, axis in enumerate(AXES):
        row = found['axes'][axis]
        assert row['mean_abs_error'] == pytest.approx(np.abs(error[:, index]).mean(), rel=1e-12)
        assert row['rms_error'] == pytest.approx(np.sqrt((error[:, index] ** 2).mean()), rel=1e-12)
        assert row['max_abs_error'] == np.abs(error[:, index]).max()
        assert row['bias'] == pytest.approx(error[:, index].mean(), rel=1e-9, abs=1e-18)
    assert found['error_source'] == 'true'
    assert found['verdict'] == 'pass'
    assert found['samples'] == np.count_nonzero(np.isin(run.phase, (Phase.TRACK, Phase.STEP)))
    assert found['duration'] == pytest.approx(found['samples'] * 1e-3)


@pytest.mark.parametrize('mode', [Mode.LANDING, Mode.FAULT])
def test_a_run_that_its_controller_left_fails(
    run: Any, records: dict[str, Records], mode: Mode
) -> None:
    states = records['controller'] = records['controller'].copy()
    states['mode'] = Mode.REGULATING
    end = records['reference']['sequence'][records['reference']['phase'] == Phase.END].min()
    states['mode'][states['sequence'] > end] = mode  # after the run it may do what it likes
    assert figures(records)['verdict'] == 'pass'
    for left in (end, end - 70, 600):
        states['mode'][states['sequence'] >= left] = mode
        found = figures(records)
        assert found['verdict'] == 'fail'
        where = f'{mode.name} from sample {left} on, in {Phase(run.phase[left]).name}'
        assert found['reasons'] == [f'the controller left the run: {where}']


def test_errors_on_the_encoders_own_scales_and_the_verdict_by_them(
    records: dict[str, Records],
) -> None:
    plain = figures(records)
    true, own = plain['axes']['x'], plain['own_axes']['x']
    assert own['bias'] == pytest.approx(true['bias'] + OWN, rel=1e-6)
    records['plant'] = records['plant'].copy()
    records['plant']['own_length'][:, 4] += 1e-3
    found = figures(records)
    assert found['axes'] == plain['axes']
    own = found['own_axes']['x']
    assert own['bias'] == pytest.approx(true['bias'] + OWN + 1e-3, rel=1e-6)
    assert own['max_abs_error'] > 1e-3
    for limit, verdict in ((own['mean_abs_error'] + 1e-9, 'pass'), (1e-3, 'fail')):
        limits = with_limits(max_mean_error=(-1.0, limit, -1.0, -1.0, -1.0))
        assert figures(records, limits)['verdict'] == verdict
    # The steps were within 1 mm on the true scale, and still are: x does not step.
    assert [step['axis'] for step in found['own_steps']] == ['y', 'theta']
    for step, there in zip(found['own_steps'], found['steps'], strict=True):
        assert step['overshoot_percent'] == pytest.approx(there['overshoot_percent'], abs=0.1)


def test_where_only_counts_are_known_half_a_count_more_is_allowed(
    records: dict[str, Records],
) -> None:
    del records['plant']
    largest = figures(records)['axes']['x']['max_abs_error']
    for less, verdict in ((4.9e-6, 'pass'), (5.1e-6, 'fail')):
        limits = with_limits(max_error=(-1.0, largest - less, -1.0, -1.0, -1.0))
        assert figures(records, limits)['verdict'] == verdict


def test_without_the_true_state_errors_are_of_the_measured_position(
    run: Any, records: dict[str, Records]
) -> None:
    true = figures(records)
    records['measurement'] = records['measurement'].copy()
    records['measurement']['gap'] += 1e-3
    both = figures(records)
    assert both['axes'] == true['axes']
    del records['plant']
    found = figures(records)
    assert both['measured_axes'] == found['measured_axes'] == found['axes']
    assert found['axes']['y']['bias'] == pytest.approx(true['axes']['y']['bias'] + 1e-3, rel=1e-6)
    error = (run.position[:, 0] + 1e-3 - run.reference[:, 0])[run.phase == Phase.TRACK]
    assert found['error_source'] == 'measured'
    assert found['axes']['y']['mean_abs_error'] == pytest.approx(np.abs(error).mean(), rel=1e-9)
    for axis in ('x', 'theta'):
        wanted = pytest.approx(true['axes'][axis]['rms_error'], rel=1e-9)
        assert found['axes'][axis]['rms_error'] == wanted
    assert found['missing_samples'] == 0


def test_gaps_that_no_tilt_can_make_never_pass(records: dict[str, Records]) -> None:
    del records['plant']
    records['measurement'] = records['measurement'].copy()
    records['measurement']['gap'][[900, 620], 1] += 1.0
    found = figures(records, with_limits(max_error=(9.0,) * 5, max_settling_time=0.2))
    assert set(found['axes']['theta'].values()) == {None}
    assert found['axes']['phi']['max_abs_error'] < 1e-2
    assert found['verdict'] == 'fail'
    assert 'largest |e| of theta was not measured: its gaps cannot be' in found['reasons']
    assert found['steps'][1]['settling_time'] >= 0.021
    json.dumps(found, allow_nan=False)


def test_currents_and_timing(run: Any, records: dict[str, Records]) -> None:
    found = figures(records)
    moving = (run.phase != Phase.REST) & (run.phase != Phase.END)
    stamp, late = run.stamp[moving], run.late[moving]
    rms = np.sqrt((run.direct**2 + run.quadrature**2)[moving].mean(axis=0))
    np.testing.assert_allclose(found['currents']['rms'], rms, rtol=1e-12)
    assert found['currents']['saturated_samples'] == np.count_nonzero(run.saturated & moving)
    assert found['currents']['saturated_by'] == {
        name: np.count_nonzero((run.limited_by & bit)[moving] > 0)
        for name, bit in (('current', 1), ('levitation', 2))
    }
    assert found['currents']['peak_thermal_load'] == 0.25
    timing = found['timing']
    ticks = np.diff(stamp) * 1e-9
    assert timing['tick_p50'] == pytest.approx(np.quantile(ticks, 0.5), abs=1.5e-6)
    assert timing['tick_p99'] == pytest.approx(np.quantile(ticks, 0.99), abs=1.5e-5)
    assert timing['tick_max'] == pytest.approx(ticks.max(), abs=1e-9)
    assert timing['late_samples'] == late[-1] - late[0]
    factor = (len(stamp) - 1) * 1e-3 / ((stamp[-1] - stamp[0]) * 1e-9)
    assert timing['real_time_factor'] == pytest.approx(factor, rel=1e-9)


@pytest.mark.parametrize('value', [np.nan, np.inf])
def test_currents_that_are_no_numbers_fail_a_run(value: float, records: dict[str, Records]) -> None:
    sound = figures(records)['currents']
    records['currents'] = records['currents'].copy()
    records['currents']['direct_current'][[700, 710], 1] = value
    records['currents']['quadrature_current'][710, 2] = value
    found = figures(records)
    assert found['verdict'] == 'fail'
    assert found['reasons'] == [
        'number of samples whose currents are no finite numbers is 2, allowed is none'
    ]
    assert found['currents']['rms'] == pytest.approx(sound['rms'], rel=1e-2)
    assert 0.0 < found['currents']['peak_phase'] <= sound['peak_phase']
    json.dumps(found, allow_nan=False)


@pytest.mark.parametrize(
    ('limited_by', 'words'),
    [
        ((1, 1, 3), ', 3 samples saturated (3 by current, 1 by levitation)'),
        ((2,), ', 1 sample saturated (1 by levitation)'),
        ((), ''),
    ],
)
def test_the_verdict_names_what_saturates(
    limited_by: tuple[int, ...], words: str, records: dict[str, Records]
) -> None:
    state = records['controller'].copy()
    state['limited_by'] = 0
    state['limited_by'][700 : 700 + len(limited_by)] = limited_by
    state['saturated'] = state['limited_by'] > 0
    found = figures({**records, 'controller': state})
    assert f'verdict: pass{words}' in as_text(found).splitlines()


def test_phase_currents_of_a_turning_vector() -> None:
    rows = np.zeros(200, ROW)
    rows['x'] = np.linspace(-0.05, 0.05, 200)
    rows['z'] = 0.01
    rows['direct_current'] = 3.0
    rows['quadrature_current'] = 4.0
    currents = phase_currents(rows, 0.05715)
    np.testing.assert_allclose(currents.sum(axis=2), 0.0, atol=1e-12)
    np.testing.assert_allclose((currents**2).sum(axis=2), 1.5 * 25.0, rtol=1e-12)
    assert np.ptp(currents[:, 0], axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    period = 2.0 * 0.05715
    shifted = rows.copy()
    shifted['x'] += period
    np.testing.assert_allclose(phase_currents(shifted, 0.05715), currents, atol=1e-9)
    np.testing.assert_allclose(currents[:, 1].max(), 5.0, rtol=1e-3)


def test_a_fault_fails_the_run_unless_it_comes_before_or_after_it(
    run: Any, records: dict[str, Records]
) -> None:
    for sequence, verdict in ((30, 'pass'), (60, 'fail'), (500, 'fail'), (1199, 'pass')):
        found = with_fault(int(run.stamp[sequence]), records)
        assert found['verdict'] == verdict
        assert (found['reasons'] == ['fault in plant: spent']) == (verdict == 'fail')


def test_a_fault_from_before_the_run_hides_none_of_the_run(
    run: Any, records: dict[str, Records]
) -> None:
    found = with_fault(int(run.stamp[500]), records, earlier=int(run.stamp[30]))
    assert found['reasons'] == ['fault in plant: spent']


@pytest.mark.parametrize('count', [1, 600])
def test_a_fault_from_before_the_run_is_none_of_it_where_the_first_measurements_are_lost(
    count: int, run: Any, records: dict[str, Records]
) -> None:
    measured = records['measurement']
    kept = {**records, 'measurement': np.delete(measured, np.arange(60, 60 + count))}
    assert with_fault(int(run.stamp[30]), kept)['faults'] == []
    assert with_fault(int(run.stamp[900]), kept)['faults'] == ['plant: spent']


def with_fault(stamp: int, records: dict[str, Records], earlier: int | None = None) -> Any:
    metrics, joiner = RunMetrics(RUN), Joiner()
    if earlier is not None:
        metrics.add_fault(earlier, 'plant', 'spent before')
    metrics.add_fault(stamp, 'plant', 'spent')
    for key, part in records.items():
        joiner.add(key, part)
    for block in joiner.finish():
        metrics.add(block)
    return metrics.result()


@pytest.mark.parametrize('pace', [0.5, 2.0])
def test_a_fault_is_placed_by_the_clock_that_stamped_it(pace: float) -> None:
    run, encoder = make_run(), Encoder()
    run.stamp = run.stamp[0] + ((run.stamp - run.stamp[0]) / pace).astype(np.int64)
    messages = {key: [encoder.message(run, key, n) for n in range(len(run))] for key in TOPICS}
    records = {key: decode(key, part) for key, part in messages.items()}
    end = int(np.flatnonzero(run.phase == Phase.END)[0])
    begin = int(np.flatnonzero(run.phase == Phase.LIFT_OFF)[0])
    for clock in (run.stamp, run.stage_time):
        assert with_fault(int(clock[begin - 10]), records)['verdict'] == 'pass'
        assert with_fault(int(clock[begin]), records)['verdict'] == 'fail'
        assert with_fault(int(clock[end - 10]), records)['verdict'] == 'fail'
        assert with_fault(int(clock[end]), records)['verdict'] == 'fail'
        assert with_fault(int(clock[end + 10]), records)['verdict'] == 'pass'


def test_figures_are_those_of_former_messages(run: Any, records: dict[str, Records]) -> None:
    former = Encoder(former=True)
    messages = {key: [former.message(run, key, n) for n in range(len(run))] for key in TOPICS}
    found = figures({key: decode(key, part) for key, part in messages.items()})
    assert found['currents'].pop('saturated_by') == {'current': 0, 'levitation': 0}
    wanted = figures(records)
    del wanted['currents']['saturated_by']
    assert found['timing'].pop('sample_time') is None  # their clock is the wall's
    assert wanted['timing'].pop('sample_time') == 1e-3
    assert found.pop('own_axes') is found.pop('own_steps') is None
    assert wanted.pop('own_axes')['x']['bias'] != wanted.pop('own_steps')
    assert found == wanted


# -- steps -----------------------------------------------------------------------------------------


def test_steps_of_a_run(run: Any, records: dict[str, Records]) -> None:
    steps = figures(records)['steps']
    assert [(step['axis'], step['from'], step['to']) for step in steps] == [
        ('y', 0.020, 0.027),
        ('theta', 0.0, 0.01),
    ]
    inside = run.segment == 3
    overshoot = (run.position[inside, 0].max() - 0.027) / 0.007 * 100.0
    assert steps[0]['overshoot_percent'] == pytest.approx(overshoot, rel=1e-9)
    outside = np.abs(run.position[inside, 0] - 0.027) > 1e-4
    assert steps[0]['settling_time'] == pytest.approx((np.flatnonzero(outside)[-1] + 1) * 1e-3)


# -- limits ----------------------------------------------------------------------------------------


def with_limits(**limits: Any) -> RunParameters:
    return build(RunParameters, {f'limits.{name}': value for name, value in limits.items()})


@pytest.mark.parametrize(
    ('limits', 'reason'),
    [
        ({'max_mean_error': (1.0, 1.0, 1.0, 1.0, 1e-6)}, 'mean |e| of theta is'),
        ({'max_error': (1.0, 1e-6, -1.0, -1.0, -1.0)}, 'largest |e| of x is'),
        ({'max_overshoot': 10.0}, 'step of y from 20 mm to 27 mm: overshoot is'),
        ({'max_settling_time': 0.01}, 't_s is 0.'),
        ({'max_encoder_time': 100.0}, 't_enc is never reached'),
        ({'max_phase_current': 1.0}, 'peak phase current is'),
        ({'max_late_samples': 2}, 'number of late samples is'),
        ({'min_real_time_factor': 3.0}, 'real-time factor is'),
        ({'min_samples': 10_000}, 'number of measured samples is 780'),
        ({'min_steps': 3}, 'number of measured steps is 2'),
    ],
)
def test_a_broken_limit_fails_the_run(
    limits: dict[str, Any], reason: str, records: dict[str, Records]
) -> None:
    found = figures(records, with_limits(**limits))
    assert found['verdict'] == 'fail'
    assert any(reason in line for line in found['reasons']), found['reasons']
    assert set(limits) <= set(found['limits'])


def test_kept_limits_pass_the_run(records: dict[str, Records]) -> None:
    limits = with_limits(
        max_mean_error=(1e-2,) * 5, max_overshoot=60.0, max_settling_time=1.0, min_samples=780
    )
    found = figures(records, limits)
    assert found['verdict'] == 'pass'
    assert found['reasons'] == []
    assert found['limits']['max_mean_error'] == dict.fromkeys(AXES, 1e-2)


def test_a_monitor_that_knows_another_sample_time_than_the_stage_fails_the_run(
    records: dict[str, Records],
) -> None:
    found = figures(records, build(RunParameters, {'sample_time': 2e-3}), burst=70)
    (reason,) = found['reasons']
    assert reason.startswith('the stage samples every 1 ms, but sample_time is 2 ms')
    assert found['verdict'] == 'fail'
    assert figures(records)['verdict'] == 'pass'


def test_what_is_exactly_at_its_limit_keeps_it(run: Any, records: dict[str, Records]) -> None:
    """A count beside 0.027 m is 1.00000000000003e-5 m, nine samples are 0.009000000000000001 s."""
    plant, reference = records['plant'].copy(), records['reference'].copy()
    reference['position'] = plant['state'][:, ::2] = run.target
    reference['position'][run.phase == Phase.TRACK, 0] = 0.027
    plant['state'][run.phase == Phase.TRACK, 0] = 2701 * 1e-5
    for segment in (3, 4):
        plant['state'][np.flatnonzero(run.segment == segment)[:9], ::2] -= 0.002
    plant['own_length'] = np.nan
    limits = with_limits(max_mean_error=(1e-5,) * 5, max_error=(1e-5,) * 5, max_settling_time=0.009)
    found = figures({**records, 'plant': plant, 'reference': reference}, limits)
    assert found['reasons'] == []
    assert found['axes']['y']['max_abs_error'] > 1e-5
    assert found['steps'][0]['settling_time'] > 0.009


def without(records: dict[str, Records], *phases: Phase) -> dict[str, Records]:
    """The same run with some phases only held."""
    changed = copy.deepcopy(records)
    changed['reference'] = changed['reference'].copy()
    changed['reference']['phase'][np.isin(changed['reference']['phase'], phases)] = Phase.HOLD
    return changed


def test_a_mean_error_limit_says_nothing_of_a_run_of_steps(records: dict[str, Records]) -> None:
    steps = without(records, Phase.TRACK)
    assert figures(steps, with_limits(max_mean_error=(1e-3,) * 5))['verdict'] == 'pass'


def test_a_mean_error_that_was_not_measured_does_not_pass(records: dict[str, Records]) -> None:
    changed = without(records, Phase.TRACK, Phase.STEP)
    limits = with_limits(max_mean_error=(1e-3,) * 5)
    found = figures(changed, limits)
    assert any('not measured' in reason for reason in found['reasons'])
    assert found['axes']['y'] == {
        'mean_abs_error': None,
        'rms_error': None,
        'max_abs_error': None,
        'bias': None,
    }
    assert found['verdict'] == 'fail'
