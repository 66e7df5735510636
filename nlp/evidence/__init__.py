"""Evidence about a point, recomputed from the program and the point only."""
