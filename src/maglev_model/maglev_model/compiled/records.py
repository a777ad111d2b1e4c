"""Named numbers and arrays in one block of memory, the same for Python and compiled functions.

A compiled function takes the block as a single argument. That costs a call from Python half a
microsecond however many fields there are; a tuple of a dozen arrays costs several.
"""

from __future__ import annotations

import inspect
from typing import Any, ClassVar, get_args

import numpy as np
from numpy.typing import NDArray

Block = NDArray[np.void]


class Record:
    """The fields that a subclass and its bases annotate: numbers, arrays, and other records.

    A number is ``float``, ``int`` or ``bool``; ``Annotated[NDArray[np.float64], 2, 6]`` is an array
    of shape (2, 6); a record within a record shares its memory. :attr:`block`, shape (1,),
    is what compiled functions take from Python; ``block[0]`` is there what they give each other,
    with the fields as attributes, and is annotated with the subclass.
    """

    dtype: ClassVar[np.dtype[np.void]]
    _records: ClassVar[dict[str, type[Record]]]

    def __init_subclass__(cls) -> None:
        fields: dict[str, Any] = {}
        for base in reversed(cls.__mro__[: cls.__mro__.index(Record)]):
            fields |= inspect.get_annotations(base, eval_str=True)
        cls.dtype = np.dtype([(name, *_element(hint)) for name, hint in fields.items()], align=True)
        cls._records = {name: hint for name, hint in fields.items() if _is_record(hint)}
        for name in fields:
            array = name in cls._records or cls.dtype[name].shape
            setattr(cls, name, _array(name) if array else _number(name))

    def __init__(self, **values: Any) -> None:
        """Fields that no value is given for are zero. Raises ValueError for what is no field."""
        self._hold(np.zeros(1, self.dtype))
        for name, value in values.items():
            self.block[name] = value.block if name in self._records else value

    def __getstate__(self) -> Block:
        """What is copied and goes to another process: the arrays are views, and made again."""
        return self.block

    def __setstate__(self, block: Block) -> None:
        """Be a copy."""
        self._hold(block)

    def _hold(self, block: Block) -> None:
        self.block: Block = block
        self._arrays: dict[str, Any] = {name: block[name][0] for name in self.dtype.names or ()}
        for name, record in self._records.items():
            within = record.__new__(record)
            within._hold(block[name])
            self._arrays[name] = within


def _element(hint: Any) -> tuple[Any, tuple[int, ...]]:
    """Type and shape of one field."""
    if _is_record(hint):
        return hint.dtype, ()
    if not hasattr(hint, '__metadata__'):
        return hint, ()
    _, dtype = get_args(hint.__origin__)
    return get_args(dtype)[0], hint.__metadata__


def _is_record(hint: Any) -> bool:
    return isinstance(hint, type) and issubclass(hint, Record)


def _number(name: str) -> property:
    def read(record: Record) -> Any:
        return record.block[name].item()

    def write(record: Record, value: float) -> None:
        record.block[name] = value

    return property(read, write)


def _array(name: str) -> property:
    return property(lambda record: record._arrays[name])
