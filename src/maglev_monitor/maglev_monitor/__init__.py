"""Metrics, recording, bag analysis and report of the maglev stage, and their nodes."""
