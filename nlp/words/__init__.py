"""Results as lines and tables that people read."""
