"""Gains and margins of an axis, computed once at configuration."""
