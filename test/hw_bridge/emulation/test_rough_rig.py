"""The machine behind the emulated boards with the effects of a real one."""

from __future__ import annotations

import numpy as np
import pytest
from bridge_flight import HOME, Flight, ellipse
from rough import PARAMS
from scipy.integrate import quad

from maglev_hw_bridge.emulation.rig import Rig
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import Mode
from maglev_model.machine import MachineParameters, machine_constants
from maglev_model.motor import force_coefficients
from maglev_model.parameters import build, from_yaml, values

M = machine_constants(MachineParameters())
LOCKED = {'emulation.guide.locked': (True,) * 5, 'emulation.winding.bandwidth': 2000.0}


def _rig(**overrides: object) -> Rig:
    named = {name.replace('__', '.'): value for name, value in overrides.items()}
    place = {'emulation.initial.position': (0.025, 0.0, 0.0, 0.0, 0.0)}
    return Rig(build(BridgeParameters, {**HOME, **LOCKED, **place, **named}))


def test_the_rail_and_the_inductance_of_the_gap_limit_the_slew() -> None:
    rig = _rig(effects__winding__voltage=28.0)
    volts = np.tile([6.0, -3.0, -3.0], 4)
    rig.advance(volts)
    gained, _ = quad(lambda g: 4.0 / 3.0 * force_coefficients(M, g)[2], 0.025, 0.031)
    inductance = 0.045 + gained
    expected = 7.0 * -np.expm1(-4.0 / inductance * 1e-3)
    assert rig.phase_current[0] == pytest.approx(expected, rel=1e-5)
    # every phase at its rail: (2 i - (-i) - (-i)) / 3, in the middle of the last step
    assert rig.stage.command[0] == pytest.approx(4.0 / 3.0 * 0.95 * expected, rel=0.01)
    slow = rig.phase_current[0]
    plain = _rig()
    plain.advance(volts)
    assert plain.phase_current[0] > 5.0 * slow  # 5 mH


def test_converters_and_offsets_act_on_what_the_boards_put_out() -> None:
    count = 20.0 / 4096.0
    rig = _rig(effects__drive__dac_bits=12, effects__drive__offset=(0.02,) + (0.0,) * 11)
    rig.advance(np.full(12, 0.0123))
    expected = np.full(12, 3.0 * count)
    expected[0] += 0.02
    assert rig.phase_current == pytest.approx(expected, rel=1e-4)


def test_latency_holds_back_what_the_boards_put_out() -> None:
    rig = _rig(effects__drive__latency=1.0)
    rig.advance(np.ones(12))
    assert not rig.phase_current.any()
    rig.advance(np.ones(12))
    assert rig.phase_current == pytest.approx(np.ones(12), rel=1e-4)


def test_a_turned_motor_counts_its_electrical_angle_along_itself() -> None:
    """As one whose commutation is off by what its other axis moves along it, rail or not."""
    missed = np.pi / M.tau * 0.03 * np.sin(0.1)
    place = {'emulation__initial__position': (0.025, 0.0, 0.03, 0.0, 0.0)}
    for voltage in (0.0, 48.0):
        found = []
        for name, value in (('angle', 0.1), ('commutation', missed)):
            motor = {f'effects__motor__{name}': (0.0, value, 0.0, 0.0)}
            rig = _rig(**motor, **place, effects__winding__voltage=voltage)
            rig.advance(np.tile([1.0, -0.5, -0.5], 4))
            found.append(rig.stage.command.copy())
        assert found[0] == pytest.approx(found[1], abs=1e-12)
        assert abs(found[0][5] - found[0][7]) > 0.05


def test_the_rough_machine_flies_on_the_bridge() -> None:
    rough = from_yaml(BridgeParameters, 'hw_bridge', PARAMS / 'rough.yaml')
    given = {k: v for k, v in values(rough).items() if k.startswith(('effects.', 'emulation.'))}
    flight = Flight(ellipse, given)
    flight.run(3000)
    assert flight.stage.fault is None, flight.stage.fault
    assert flight.stage.mode is Mode.FOLLOWING
    error = flight.rig.state[::2] - ellipse(2.999)[0]
    assert np.all(np.abs(error) < 1e-4)
