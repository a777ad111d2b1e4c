"""What each phase alone moves: the pulses of commissioning, on the machine and on a twin of it.

One phase at a time gets a slowly rising current, one way and the other, until an encoder has seen
enough. With the wiring that the parameters claim, the emulated machine foretells every encoder's
answer, with several frictions, as the machine's own is not known yet. Which single error would
explain what was seen instead is found in :mod:`maglev_hw_bridge.commissioning.diagnosis`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

import numpy as np

from maglev_hw_bridge.amplifiers import Amplifiers
from maglev_hw_bridge.commissioning.proof import refuse_pressed
from maglev_hw_bridge.drivers import CountArray, SampledDriver, VoltArray
from maglev_hw_bridge.emulation.rig import Rig
from maglev_hw_bridge.encoders import Encoders
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.signal_parameters import PHASES
from maglev_model.axes import FloatArray

_RISE = 0.1  # to the peak current [s]
_GAP_ENOUGH = 3e-4  # [m]
_HORIZONTAL_ENOUGH = 4e-3  # [m]
_QUIET = 0.05  # without a count, then the platen rests [s]
_LONGEST_WAIT = 3.0  # for that [s]
_FRICTIONS = ((1.0, 1.0), (0.6, 0.6), (0.6, 1.5), (1.5, 0.6), (1.5, 1.5))  # x and z, tilts


class Pulses:
    """Pulses on one set of boards; the driver must be open, and is started and stopped here."""

    def __init__(
        self,
        parameters: BridgeParameters,
        driver: SampledDriver,
        encoders: Encoders,
        amplifiers: Amplifiers,
        peak: float,
        settles: bool = True,
    ) -> None:
        """``peak``: largest phase current [A]; ``settles``: wait for the platen at the end too."""
        self._driver, self._encoders, self._amplifiers = driver, encoders, amplifiers
        self._period = parameters.sample_time
        self._peak = peak
        self._settles = settles
        self._counts = np.zeros(6, dtype=np.int32)
        self._current = np.zeros(PHASES)

    def phase(self, phase: int) -> FloatArray:
        """What the encoders saw of one phase's current, (2, 6) [m]: positive, then negative.

        Raises DriverError, and WrongError once the emergency stop is pressed.
        """
        refuse_pressed(self._driver)
        self._amplifiers.cut()
        self._driver.start()
        try:
            self._sample()
            forth = self._pulse(phase, 1.0)
            self._settle()
            back = self._pulse(phase, -1.0)
            if self._settles:
                self._settle()
            return np.array([forth, back])
        finally:
            self._current[:] = 0.0
            self._driver.stop()

    def _sample(self) -> FloatArray:
        self._driver.write(self._amplifiers.drive_phases(self._current))
        self._driver.read(self._counts)
        refuse_pressed(self._driver)
        return self._encoders.decode(self._counts)

    def _pulse(self, phase: int, sign: float) -> FloatArray:
        start = self._sample().copy()
        steps = round(_RISE / self._period)
        moved = np.zeros(6)
        for n in range(1, steps + 1):
            self._current[phase] = sign * self._peak * n / steps
            moved = self._sample() - start
            far = np.abs(moved).tolist()
            if max(far[:4]) > _GAP_ENOUGH or max(far[4:]) > _HORIZONTAL_ENOUGH:
                break
        self._current[:] = 0.0
        return moved

    def _settle(self) -> None:
        """Wait without current until no encoder counts any more."""
        last, quiet = self._sample().tolist(), 0.0
        for _ in range(round(_LONGEST_WAIT / self._period)):
            now = self._sample().tolist()
            quiet = quiet + self._period if now == last else 0.0
            last = now
            if quiet >= _QUIET:
                return

    @property
    def place(self) -> FloatArray:
        """Where the platen stands, as the encoders have it: x, z [m]."""
        return np.array(self._encoders.arrays.length[4:])


def friction_variants(parameters: BridgeParameters) -> list[BridgeParameters]:
    """The same machine with other frictions of its guides, for :class:`Twins`; itself first."""
    return [_rubbing(parameters, *factors) for factors in _FRICTIONS]


def angle_variants(parameters: BridgeParameters, angles: Iterable[float]) -> list[BridgeParameters]:
    """The same machine with all motors' electrical angles off by each [rad], for :class:`Twins`."""
    commutation = parameters.commutation
    return [
        dataclasses.replace(
            parameters,
            commutation=dataclasses.replace(
                commutation, offset=tuple(offset + angle for offset in commutation.offset)
            ),
        )
        for angle in angles
    ]


class Twins:
    """Emulated machines, wired as their parameters claim."""

    def __init__(self, variants: Iterable[BridgeParameters], peak: float) -> None:
        """``peak``: largest phase current [A]."""
        self._twins = [_Twin(variant, peak) for variant in variants]

    def phase(self, phase: int, place: FloatArray) -> FloatArray:
        """What each one's encoders should see of a phase, (n, 2, 6) [m], from x, z [m]."""
        return np.array([twin.phase(phase, place) for twin in self._twins])


def _rubbing(parameters: BridgeParameters, horizontal: float, tilt: float) -> BridgeParameters:
    guide = parameters.emulation.guide
    factors = (1.0, horizontal, horizontal, tilt, tilt)
    coulomb = tuple(f * force for f, force in zip(factors, guide.coulomb, strict=True))
    emulation = dataclasses.replace(
        parameters.emulation, guide=dataclasses.replace(guide, coulomb=coulomb)
    )
    return dataclasses.replace(parameters, emulation=emulation)


class _Twin:
    def __init__(self, parameters: BridgeParameters, peak: float) -> None:
        amplifier, encoder = parameters.amplifier, parameters.encoder
        wiring = dataclasses.replace(
            parameters.emulation.wiring,
            phase_board=amplifier.board,
            phase_channel=amplifier.channel,
            phase_sign=amplifier.sign,
            gain=amplifier.gain,
            offset=amplifier.offset,
            angle=parameters.commutation.offset,
            encoder_board=encoder.board,
            encoder_channel=encoder.channel,
            encoder_direction=encoder.direction,
        )
        inject = dataclasses.replace(parameters.emulation.inject, sample=-1)
        emulation = dataclasses.replace(parameters.emulation, wiring=wiring, inject=inject)
        counts = emulation.encoder  # the rig's own, whatever those of the machine are worth
        resolution = (counts.gap_resolution,) * 4 + (counts.horizontal_resolution,) * 2
        twin = dataclasses.replace(
            parameters,
            emulation=emulation,
            encoder=dataclasses.replace(encoder, resolution=resolution),
        )
        self._rig = Rig(twin)
        self._rest = parameters.machine.gap_max
        driver = _RigDriver(self._rig)
        self._pulses = Pulses(twin, driver, Encoders(twin), Amplifiers(twin), peak, settles=False)

    def phase(self, phase: int, place: FloatArray) -> FloatArray:
        self._rig.place(np.array([self._rest, place[0], place[1], 0.0, 0.0]))
        self._rig.arrays.current[:] = 0.0
        return self._pulses.phase(phase)


class _RigDriver:
    """The rig without boards before it: nothing to arm, enable or disable."""

    stop_pressed = False

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._volts = np.zeros(PHASES)

    def start(self) -> None:
        pass

    def write(self, volts: VoltArray) -> None:
        self._volts[:] = volts

    def read(self, counts: CountArray) -> None:
        self._rig.advance(self._volts)
        counts[:] = self._rig.counts()

    def stop(self) -> None:
        pass
