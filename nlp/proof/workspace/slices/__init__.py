"""Slices through a workspace: ``slice_limits`` (limits over boxes), then ``slices`` (planes covered by boxes)."""
