"""Starter cases: a commented case file for any robot, which follows from the robot at home.

The modules import each other in this order: ``home``, ``text``.
"""
