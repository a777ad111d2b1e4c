"""What must outlast the process that drives the boards, and that there is only one.

A small file keeps the amplifiers' I²t load and a latched fault. While a bridge is active, or
commissioned, it says only that: what ends without stopping, killed or without power, is a fault
when it comes back, with the amplifiers at full load. Written when the bridge is activated,
deactivated, reset and closed.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import math
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.signal_parameters import PHASES
from maglev_model.axes import FloatArray
from maglev_model.contract.stage import Fault, StageError
from maglev_model.parameters import ParameterError

_FULL = 1.0  # I²t load of a phase that nobody knows anything about
_BOOT = Path('/proc/sys/kernel/random/boot_id')
_SEE = 'see to the machine and its amplifiers'


class Kept(NamedTuple):
    """What is known of the time before."""

    load: FloatArray  # I²t load of the phases by now, (12,)
    fault: Fault | None


def memory_file(parameters: BridgeParameters) -> Path | None:
    """Where it is kept; None: nowhere, as by default with emulated boards.

    The same boards have the same one, in whichever order. Raises ParameterError when that is below
    a home that nobody knows, or depends on where the process was started.
    """
    boards = parameters.boards
    if parameters.driver == 'emulated' and not boards.memory:
        return None
    try:
        if boards.memory:
            path = Path(boards.memory).expanduser()
        else:
            state = Path(os.environ.get('XDG_STATE_HOME') or Path.home() / '.local' / 'state')
            name = '-'.join([boards.type, *sorted(boards.identifier)]).replace(os.sep, '_')
            path = state / 'maglev-stage' / f'{name}.json'
    except RuntimeError as error:  # whose home is not known
        raise ParameterError(
            f"parameter 'boards.memory' is '{boards.memory}': {error} Name a file by its whole path"
        ) from error
    if not path.is_absolute():
        raise ParameterError(
            f"parameter 'boards.memory' is '{boards.memory}', which makes '{path}', another file "
            'in every folder that a bridge is started in: name it by its whole path'
        )
    return path


def _since_boot() -> float:
    """Time since the computer was started, asleep too [s]; nobody sets that clock."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


def _this_boot() -> str:
    """What tells this start of the computer from all others; nothing where it does not say."""
    try:
        return _BOOT.read_text(encoding='ascii').strip()
    except (OSError, UnicodeDecodeError):
        return ''


class Memory:
    """The file of one pair of boards.

    ``clock`` tells the time since the computer was started [s], ``boot`` which start that was.
    """

    def __init__(
        self,
        parameters: BridgeParameters,
        clock: Callable[[], float] = _since_boot,
        boot: Callable[[], str] = _this_boot,
    ) -> None:
        self._path = memory_file(parameters)
        self._thermal_time = parameters.amplifier.thermal_time
        self._clock, self._boot = clock, boot
        self._lock: IO[str] | None = None

    def claim(self) -> None:
        """Be the only one with these boards until :meth:`release`. Raises StageError."""
        if self._path is None or self._lock is not None:
            return
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            lock = self._path.with_name(self._path.name + '.lock').open('a')
        except OSError as error:
            raise self._unusable(error) from error
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            lock.close()
            raise StageError(
                f"the boards are in use: another bridge, or commissioning, holds '{lock.name}'"
            ) from error
        self._lock = lock

    def release(self) -> None:
        """Let others have the boards."""
        if self._lock is not None:
            self._lock.close()
            self._lock = None

    def recall(self) -> Kept:
        """What is known; of what is not, the worst. Raises StageError."""
        if self._path is None:
            return Kept(np.zeros(PHASES), None)
        unknown = np.full(PHASES, _FULL)
        try:
            text = self._path.read_text(encoding='utf-8')
        except FileNotFoundError:
            return Kept(unknown, None)
        except (OSError, UnicodeDecodeError):
            text = ''
        try:
            return self._understand(json.loads(text))
        except (ValueError, TypeError, KeyError, OverflowError, RecursionError):
            reason = f"what '{self._path}' kept of the last run is damaged"
            return Kept(unknown, Fault('memory', reason, _SEE, True))

    def _understand(self, content: dict[str, Any]) -> Kept:
        if content['active']:
            reason = 'the last run ended without stopping: killed, or the power failed'
            return Kept(np.full(PHASES, _FULL), Fault('ended', reason, _SEE, True))
        load = np.array(content['load'], dtype=np.float64)
        if load.shape != (PHASES,) or not np.all((load >= 0.0) & np.isfinite(load)):
            raise ValueError
        kept_at = float(content['time'])
        if not math.isfinite(kept_at):
            raise ValueError
        passed = self._passed(kept_at, content.get('boot'))
        given = content['fault']
        fault = None
        if given is not None:
            kind, reason, remedy, cut = given
            fault = Fault(str(kind), str(reason), str(remedy), bool(cut))
        return Kept(load * np.exp(-passed / self._thermal_time), fault)

    def _passed(self, kept_at: float, boot: object) -> float:
        """Time that has passed for sure [s]: the clock on the wall may have been set meanwhile.

        Since an earlier start of the computer that is the time since its last one.
        """
        now, this = self._clock(), self._boot()
        if not (boot and this):
            return 0.0
        return max(now - kept_at if boot == this else now, 0.0)

    def keep(self, load: FloatArray, fault: Fault | None, *, active: bool) -> None:
        """Write it, all or nothing. Raises StageError."""
        if self._path is None:
            return
        content = {
            'active': active,
            'load': load.tolist(),
            'time': self._clock(),
            'boot': self._boot(),
            'fault': None if fault is None else list(fault),
        }
        new = self._path.with_name(self._path.name + '.new')
        try:
            with new.open('w', encoding='utf-8') as file:
                json.dump(content, file)
                file.flush()
                os.fsync(file.fileno())
            new.replace(self._path)
            _outlast_power(self._path.parent)
        except OSError as error:
            with contextlib.suppress(OSError):
                new.unlink()
            raise self._unusable(error) from error

    def forget_proof(self) -> None:
        """The last line is being proven anew: what was proven before does not hold any more.

        Raises StageError.
        """
        if self._path is not None:
            try:
                self._proof_file.unlink(missing_ok=True)
            except OSError as error:
                raise self._unusable(error) from error

    def record_proof(self, parameters: BridgeParameters) -> None:
        """Keep that the last line was proven with these parameters. Raises StageError."""
        if self._path is not None:
            try:
                self._proof_file.write_text(json.dumps(_last_line(parameters)), encoding='utf-8')
            except OSError as error:
                raise self._unusable(error) from error

    def proven(self, parameters: BridgeParameters) -> bool:
        """Whether the last line was proven with what the parameters say of it."""
        try:
            content = json.loads(self._proof_file.read_text(encoding='utf-8'))
        except (OSError, ValueError, RecursionError):
            return False
        return bool(content == _last_line(parameters))

    @property
    def _proof_file(self) -> Path:
        assert self._path is not None
        return self._path.with_name(self._path.stem + '-proven.json')

    def _unusable(self, error: OSError) -> StageError:
        return StageError(
            f"what must outlast this process cannot be kept in '{self._path}': {error.strerror}; "
            "let it be written there, or name another file by parameter 'boards.memory'"
        )


def _outlast_power(folder: Path) -> None:
    """What was renamed in there keeps its new name, where the file system can promise that."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):
            os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _last_line(parameters: BridgeParameters) -> dict[str, Any]:
    """What the proof of the last line holds for."""
    names = ['type', 'watchdog', 'stop_input', 'stop_level', 'enable_output', 'enable_level']
    names += ['open_level', 'digital_expiry', 'analog_expiry']
    lines = {name: getattr(parameters.boards, name) for name in names}
    which = list(parameters.boards.identifier)  # the first has the lines
    return {'driver': parameters.driver, 'identifier': which, **lines}
