"""Pictures: a robot and its task as numbers, as picture files, and as a page."""
