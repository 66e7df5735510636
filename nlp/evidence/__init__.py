"""What holds at a point, recomputed from the program and the point alone."""
