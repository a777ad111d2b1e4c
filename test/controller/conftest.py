"""The module of a made-up law."""

from made_up_law import law_module

__all__ = ['law_module']
