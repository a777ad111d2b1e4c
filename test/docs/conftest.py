"""A made-up run and its bag."""

from bag_fixtures import bag, encoder, messages, run

__all__ = ['bag', 'encoder', 'messages', 'run']
