"""A case: what is asked, as values, and from a file."""
