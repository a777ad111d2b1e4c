"""Imported first where nodes are forked from: they call what was compiled ahead, as a user's do."""

from maglev_model.compiled import ahead

ahead.use()
