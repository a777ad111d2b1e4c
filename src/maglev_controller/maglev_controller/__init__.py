"""Feedback linearisation and internal-model regulator of the maglev stage, and its node."""
