"""Schedules: settings of a robot that change along its tool path, found by dynamic programming and Ipopt."""
