"""Slices through a workspace: ``limitcells`` decides limits on boxes, ``slices`` covers planes by boxes."""
