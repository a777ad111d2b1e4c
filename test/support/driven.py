"""The real driver on boards that check its calls."""

from __future__ import annotations

import numpy as np
from hil_check import Module

from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import build

LINES = {'boards__stop_input': 3, 'boards__enable_output': 5}


def driver_on(module: Module, **overrides: object) -> QuanserDriver:
    names = {name.replace('__', '.'): value for name, value in overrides.items()}
    return QuanserDriver(build(BridgeParameters, names), module, lambda: 0.0, module.sleep)


def run(driver: QuanserDriver, samples: int = 5) -> np.ndarray:
    counts = np.zeros(6, dtype=np.int32)
    for k in range(samples):
        driver.read(counts)
        driver.write(np.linspace(-7.0, 7.0, 12) * ((k + 1) / samples))
    return counts
