"""A change of parameters in flight, as the controller makes it."""

from __future__ import annotations

from maglev_controller.bumpless_transfer import model_maps
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator


def retuned(old: Regulator, parameters: ControllerParameters) -> Regulator:
    """A regulator with other parameters that goes on where ``old`` is."""
    new = Regulator(parameters)
    new.take_over(old, model_maps(old.arrays, new.arrays))
    return new
