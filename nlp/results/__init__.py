"""Solutions as data, and in words."""
