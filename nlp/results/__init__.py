"""Results as typed values and as JSON."""
