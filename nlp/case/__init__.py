"""Cases: synthesis problems as Python objects, and the reader and writer of their files."""
