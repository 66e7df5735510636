"""Output: terminal, files, pictures and reports."""
