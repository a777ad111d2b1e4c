"""Whether stage, controller and reference run in one mode."""

from __future__ import annotations


def mode_conflict(ours: str, lockstep: bool) -> str:
    """Why a node in mode ``ours`` cannot work with a stage that is in lockstep or not; '' if not.

    In real time the stage waits for nobody, in lockstep for every answer: mixed, samples would be
    lost or never come.
    """
    stage = 'lockstep' if lockstep else 'realtime'
    if ours == stage:
        return ''
    return (
        f"the stage runs in mode '{stage}', this node in mode '{ours}': start stage, controller and"
        " reference with one 'mode'"
    )
