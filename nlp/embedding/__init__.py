"""C for embedding: the objective of a case and a whole solver, from the templates in ``c``."""
