"""Copies between arrays in compiled code."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from maglev_model.compiled import borrowing


@borrowing
def copy_to(values: NDArray[Any], target: NDArray[Any]) -> None:
    """Copy ``values`` (n,) into ``target`` (n,).

    As ``target[:] = values``, for which Numba compiles what would be said of unlike shapes: seconds
    in each process that compiles. Here these are not looked at.
    """
    for i in range(len(target)):
        target[i] = values[i]
