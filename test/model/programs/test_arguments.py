"""What a command line takes for a number, and what it refuses."""

from __future__ import annotations

import argparse
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maglev_model.programs.arguments import count, not_negative, number, positive, whole_number

NONE = ('', 'x', 'nan', 'inf', '-inf', '1e400', '1,5')


def refusal(kind, text: str) -> str:
    with pytest.raises(argparse.ArgumentTypeError) as refused:
        kind(text)
    return str(refused.value)


@given(st.floats(0.0, 1.7e308))
def test_finite_numbers_are_taken_as_they_are(value: float) -> None:
    assert not_negative(repr(value)) == value
    assert number(value)(repr(value)) == value
    assert number(0.0, value)(repr(value)) == value
    assert 'above' in refusal(number(value, above=True), repr(value))
    assert repr(value) in refusal(number(math.nextafter(value, math.inf)), repr(value))


@pytest.mark.parametrize('text', NONE)
def test_what_is_no_number_is_refused_with_its_bounds(text: str) -> None:
    assert refusal(positive, text) == f"'{text}' is no finite number above 0"
    assert refusal(not_negative, text) == f"'{text}' is no finite number of at least 0"
    assert refusal(number(0.2, 3.0), text) == f"'{text}' is no finite number from 0.2 to 3"
    assert refusal(count, text) == f"'{text}' is no whole number of at least 0"
    assert refusal(whole_number(1, 9), text) == f"'{text}' is no whole number from 1 to 9"


@pytest.mark.parametrize(
    ('kind', 'taken', 'refused'),
    [
        (positive, ('5e-324', '1e300'), ('0', '-0.0', '-1')),
        (not_negative, ('0', '-0.0'), ('-5e-324',)),
        (number(0.2, 3.0), ('0.2', '3'), ('0.19', '3.01')),
        (count, ('0', '123456789012'), ('-1', '1.0', '+1', '²')),
        (whole_number(1), ('1',), ('0',)),
        (whole_number(1, 9), ('1', '9'), ('0', '10')),
    ],
)
def test_the_bounds_from_both_sides(kind, taken: tuple[str, ...], refused: tuple[str, ...]) -> None:
    for text in taken:
        assert kind(text) == float(text)
    for text in refused:
        assert text in refusal(kind, text)
