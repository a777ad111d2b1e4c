"""Numbers of an axis tuned for the worst machines: judged by these, and within the margin."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from maglev_controller.parameters import ControllerParameters
from maglev_model.axes import AXES
from maglev_model.parameters import ParameterError, from_yaml, replace
from maglev_study.command import DONE, INTERRUPTED, WRONG_USE
from maglev_study.comparison.contestants import Contestant
from maglev_study.robustness import tune as module
from maglev_study.robustness.fleet import make_plan
from maglev_study.robustness.fly import FLOWN, Flown
from maglev_study.robustness.fly import LOST as LOST_FLIGHT
from maglev_study.robustness.tune import (
    LOST,
    Course,
    Numbers,
    Search,
    Trial,
    Tuned,
    check_tunable,
    guaranteed,
    numbers_of,
    with_numbers,
)
from maglev_study.robustness.tune_main import NO_BETTER, better, render, run

PARAMS = Path(__file__).resolve().parents[3] / 'params'


def flown(plan: Any, _: str, number: int) -> list[Flown]:
    """Errors of y as large as the machine's number and its bandwidth; the tenth machine is lost."""
    (contestant,) = plan.contestants
    size = (1.0 + number) * contestant.controller.y.bandwidth / 195.0
    mean = 1e-4 * np.array([size, 1.0, 1.0, 1.0, 1.0])
    verdict = LOST_FLIGHT if number == 10 else FLOWN
    return [Flown(number, 'default', 'ellipse', verdict, mean=mean)]


def test_the_worst_machines_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, 'fly_machine', flown)
    plan = make_plan(PARAMS, 21, names=['ellipse'])
    course = Course(plan)
    numbers = numbers_of(plan.contestants[0].controller)
    worst = course.trial(numbers).worst
    assert worst[0] == LOST
    assert worst[1] == pytest.approx(0.5 * (LOST + 1.0))  # two of 21 count, one of them lost
    slower = {**numbers, 'y': {**numbers['y'], 'bandwidth': 19.5}}
    assert course.trial(slower).worst[0] == pytest.approx(0.5 * (LOST + 2.2))


def test_what_is_asked_has_the_margin(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip('optuna', reason='needs optuna, which set-up does not install')
    (contestant,) = make_plan(PARAMS, 1).contestants
    asked: list[float] = []
    monkeypatch.setattr(module, 'guaranteed', lambda one: 1200.0 / one.controller.x.bandwidth)
    search = Search(contestant, 6.0, seed=0)
    first = search.ask()
    assert first == numbers_of(contestant.controller)
    for _ in range(30):
        numbers = search.ask() if asked else first
        asked += [each['bandwidth'] for each in numbers.values()]
        search.tell(Trial(numbers, np.array([200.0 / n['bandwidth'] for n in numbers.values()])))
    assert max(asked) <= 200.0 < 1.01 * max(asked)
    assert 190.0 < search.best()['y']['bandwidth'] <= 200.0
    Search(contestant, 6.0, seed=2**53)
    with pytest.raises(ParameterError, match='no numbers of y are guaranteed ±50 dB'):
        Search(contestant, 50.0, seed=0).ask()


def test_faster_is_guaranteed_less_and_what_is_refused_nothing() -> None:
    (contestant,) = make_plan(PARAMS, 1).contestants
    numbers = {'bandwidth': 330.0, 'integration': 90.0, 'learning': 10.0}
    faster = with_numbers(contestant, dict.fromkeys(AXES, numbers))
    assert 0.0 < guaranteed(faster) < guaranteed(contestant)
    refused = replace(contestant.controller, {'margins.phase': 80.0})
    assert guaranteed(dataclasses.replace(contestant, controller=refused)) == 0.0


def test_a_law_without_such_numbers_is_refused() -> None:
    for law in ('paper', 'feedback_lead_lag'):
        (contestant,) = make_plan(PARAMS, 1, laws=[law]).contestants
        with pytest.raises(ParameterError, match=f"law '{law}' has no bandwidth"):
            check_tunable(contestant)


def test_better_is_better_on_some_and_worse_on_no_axis() -> None:
    numbers = numbers_of(make_plan(PARAMS, 1).contestants[0].controller)
    default = Trial(numbers, np.full(5, 2.0))
    for worst, verdict in (
        ([2.0, 2.0, 1.9, 2.0, 2.0], True),
        ([2.0] * 5, False),
        ([1.0, 2.1, 1.0, 1.0, 1.0], False),
    ):
        found = Tuned(numbers, (default, Trial(numbers, np.array(worst))), 6.1)
        assert better(found) == verdict
        assert ('beats' in render(found, 40, 0)) == verdict


class Known(Search):
    """A search without a library, that knows what is best."""

    def __init__(self, contestant: Contestant, *_: object) -> None:
        self._numbers = numbers_of(contestant.controller)

    def ask(self) -> Numbers:
        return self._numbers

    def tell(self, trial: Trial) -> None:
        assert trial.numbers == self._numbers

    def best(self) -> Numbers:
        return {**self._numbers, 'y': {**self._numbers['y'], 'bandwidth': 150.0}}


@pytest.mark.parametrize('trials', [0, 1])
def test_ctrl_c_keeps_the_numbers_that_are_found(
    trials: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    def interrupted(plan: Any, code: str, number: int) -> list[Flown]:
        if plan.seed or (number and not trials):
            raise KeyboardInterrupt
        return flown(plan, code, number)

    monkeypatch.setattr(module, 'Search', Known)
    monkeypatch.setattr(module, 'fly_machine', interrupted)
    call = ['--params', str(PARAMS), '--machines', '1', '--jobs', '1', '--out', str(tmp_path)]
    assert run([*call, '--experiment', 'ellipse', '--trials', '1']) == INTERRUPTED
    path = tmp_path / 'tuned.yaml'
    assert path.exists() == bool(trials)
    if trials:
        assert 'NOT compared with the numbers as they were' in path.read_text(encoding='utf-8')
        assert from_yaml(ControllerParameters, 'controller', path).y.bandwidth == 150.0
    else:
        assert 'tune: error: interrupted' in capsys.readouterr().err


def test_the_command_leaves_parameters_that_the_controller_takes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    pytest.importorskip('optuna', reason='needs optuna, which set-up does not install')
    call = ['--params', str(PARAMS), '--machines', '2', '--trials', '3', '--jobs', '1']
    call += ['--experiment', 'step_y', '--out', str(tmp_path)]
    code = run(call)
    said = capsys.readouterr().out
    assert 'tune: 3 of 3 tried, worst machines by axis' in said
    assert code == (DONE if ' beats ' in said else NO_BETTER)
    found = from_yaml(ControllerParameters, 'controller', tmp_path / 'tuned.yaml')
    assert f'bandwidth: {found.theta.bandwidth}' in said
    (contestant,) = make_plan(PARAMS, 1).contestants
    assert guaranteed(dataclasses.replace(contestant, controller=found)) >= 6.0
    assert run([*call, '--law', 'paper']) == WRONG_USE
    assert 'has no bandwidth, integration and learning' in capsys.readouterr().err
