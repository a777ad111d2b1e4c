"""The real driver on boards that check its calls."""

from __future__ import annotations

import numpy as np
from hil_check import Module

from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import build

LINES = {'boards__stop_input': 3, 'boards__enable_output': 5}


def bridge_parameters(**overrides: object) -> BridgeParameters:
    """``__`` in a parameter's name stands for a dot."""
    names = {name.replace('__', '.'): value for name, value in overrides.items()}
    return build(BridgeParameters, names)


def driver_on(module: Module, **overrides: object) -> QuanserDriver:
    return QuanserDriver(bridge_parameters(**overrides), module, lambda: 0.0, module.sleep)


def started(module: Module, **overrides: object) -> QuanserDriver:
    driver = driver_on(module, **overrides)
    driver.open()
    driver.start()
    return driver


def run(driver: QuanserDriver, samples: int = 5) -> np.ndarray:
    counts = np.zeros(6, dtype=np.int32)
    for k in range(samples):
        driver.read(counts)
        driver.write(np.linspace(-7.0, 7.0, 12) * ((k + 1) / samples))
    return counts
