"""Imported first where nodes are forked from: they call what was compiled ahead, as a user's do."""

from maglev_model import ahead

ahead.use()
