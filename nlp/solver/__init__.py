"""Solve of a case: Ipopt from many starting points, combination of tasks, and certified solves."""
