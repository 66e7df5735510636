"""Proof file of settings for every pose: a tree of cuts of the workspace, and the value of each setting in each box."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..checker.proof_file import Premises, Proof, ProofClaim, workspace_premise
from ..statement.chosen_settings import SETTINGS

if TYPE_CHECKING:
    from .pose_settings import SettingsProof


def settings_proof_of(found: SettingsProof, text: str) -> Proof:
    """Return the proof of settings for every pose; without claims if they are not proved.

    Args:
        found: the verdict.
        text: text of the case file.
    """
    premises = Premises(workspace_premise(found.workspace), (), (), 0.0, settings=found.names)
    values = tuple(each.values for each in found.boxes)
    claim = ProofClaim(SETTINGS, "", SETTINGS, tree=found.tree, sides=values)
    return Proof(text, found.case.name, premises, (claim,) if found.is_proved else ())
