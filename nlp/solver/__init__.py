"""Search: Ipopt from many starts, several tasks, certified solves."""
