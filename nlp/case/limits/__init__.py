"""Limits of a case, which a buildable design satisfies."""
