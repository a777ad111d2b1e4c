"""What phases move tells every single error in the wiring from every other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from bridge_flight import HOME

from maglev_hw_bridge.commissioning.diagnosis import _explanations, diagnose
from maglev_hw_bridge.commissioning.response import Twins, friction_variants
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import build

PEAK = 1.5


@pytest.fixture(scope='module')
def foretold() -> np.ndarray:
    twins = Twins(friction_variants(build(BridgeParameters, HOME)), PEAK)
    moved = [twins.phase(phase, np.zeros(2)) for phase in range(12)]
    return np.stack(moved, axis=1)[..., None, :]


def test_every_single_error_is_told_from_every_other(foretold: np.ndarray) -> None:
    explanations = list(_explanations(foretold))
    assert len(explanations) == 1 + 12 + 6 + 66 + 15
    noise = np.random.default_rng(1).uniform(0.85, 1.15, foretold.shape[1:])
    for text, shown in explanations:
        finding = diagnose(shown[0] * noise, foretold)
        assert finding.fine == (text == '')
        assert finding.text == text or not text


def test_two_errors_at_once_are_no_single_one(foretold: np.ndarray) -> None:
    seen = foretold[0].copy()
    for phase in (0, 4, 8, 11):
        seen[phase] = seen[phase, ::-1]
    seen[..., 4] *= -1.0
    assert not diagnose(seen, foretold).fine


def test_what_looks_alike_is_told_apart_where_it_does_not(foretold: np.ndarray) -> None:
    alike = foretold.copy()
    alike[:, 6] = alike[:, 0]
    finding = diagnose(alike[0], alike)
    assert (finding.fine, finding.explanations) == (False, 2)
    assert finding.text.startswith('either: all is well; or: motor 1 phase a and motor 3 phase a')
    assert finding.text.endswith('check amplifier.*, commutation.* and machine.*')
    both = np.concatenate([alike, foretold], axis=3)
    assert diagnose(both[0], both).fine
    both[:, [0, 6]] = both[:, [6, 0]]
    finding = diagnose(both[0], np.concatenate([alike, foretold], axis=3))
    assert finding.text.startswith('motor 1 phase a and motor 3 phase a are exchanged')


@pytest.mark.parametrize(
    ('dead', 'blind', 'text'),
    [
        ([0], [], 'motor 1 phase a moves nothing'),
        ([], [3], 'encoder gap 4 sees nothing'),
        ([], [0, 1, 2, 3], 'encoder gap 1 sees nothing'),  # phases a move no other encoder
        ([], [4, 5], 'encoder x sees nothing'),
        ([3, 4, 5, 9, 10, 11], [], 'motor 2 phase a moves nothing'),  # which x does not see, too
        (range(12), [], 'no encoder sees any phase'),
        ([], range(6), 'no encoder sees any phase'),
    ],
)
def test_what_does_not_answer_is_named(
    dead: Sequence[int], blind: Sequence[int], text: str, foretold: np.ndarray
) -> None:
    seen = foretold[0].copy()
    seen[list(dead)] = 0.0
    seen[..., list(blind)] *= 1e-3  # as for a resolution in other units
    finding = diagnose(seen, foretold)
    assert not finding.fine
    assert finding.text.startswith(text)
    assert ('encoder.resolution' in finding.text) == (len(blind) > 0 or len(dead) == 12)


def test_pulses_are_small(foretold: np.ndarray) -> None:
    assert np.max(np.abs(foretold[..., :4])) < 5e-4
    assert np.max(np.abs(foretold[..., 4:])) < 5e-3
