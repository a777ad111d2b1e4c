"""Bags: recording, reading, analysing."""
