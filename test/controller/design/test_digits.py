"""What is designed is the same on every processor: whichever kernels BLAS takes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from maglev_controller.design.digits import rounded

PARAMS = Path(__file__).resolve().parents[3] / 'params'

DESIGN = """
import hashlib, sys
from pathlib import Path
from maglev_controller.learning import IterativeLearning
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.parameters import from_yaml

for names in sys.argv[2:]:
    files = [Path(sys.argv[1]) / f'{name}.yaml' for name in names.split()]
    parameters = from_yaml(ControllerParameters, 'controller', *files)
    arrays = Regulator(parameters).arrays
    made = [arrays.records, arrays.models, arrays.transition]
    if parameters.learning.period > 0.0:
        made.append(IterativeLearning(parameters).arrays.kernels)
    print(names, *(hashlib.sha256(each.tobytes()).hexdigest() for each in made))
"""


def test_whichever_kernels_blas_takes() -> None:
    """Prescott's know neither AVX nor FMA; they make the last digits differ."""
    asked = ('machine', 'machine rough', 'machine learning', 'machine matched_helix')
    made = {
        kernels: subprocess.run(
            [sys.executable, '-c', DESIGN, str(PARAMS), *asked],
            env={**os.environ, 'OPENBLAS_CORETYPE': kernels},
            capture_output=True,
            text=True,
            check=True,
        ).stdout.splitlines()
        for kernels in ('Prescott', 'Haswell')
    }
    assert len(made['Haswell']) == len(asked)
    assert made['Prescott'] == made['Haswell']


@given(st.floats(-1e300, 1e300), st.integers(1, 15))
def test_so_many_digits_are_kept(value: float, digits: int) -> None:
    (kept,) = rounded([value], digits)
    assert kept == pytest.approx(value, rel=0.5000001 * 10.0 ** (1 - digits), abs=1e-300)
    assert rounded([kept], digits) == [kept]


def test_of_any_shape() -> None:
    np.testing.assert_array_equal(
        rounded([[1.26, 0.0], [-2.0e-9, np.inf]], 2), [[1.3, 0.0], [-2e-9, np.inf]]
    )
