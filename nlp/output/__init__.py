"""Output of results: terminal, files, pictures, pages and notebooks."""
