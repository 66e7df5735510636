"""A case: a synthesis problem as values, and from a file."""
