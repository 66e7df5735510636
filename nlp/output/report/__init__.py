"""A solved case as one page of HTML."""
