"""Starter cases: a commented case file for any robot, generated from the robot in its home configuration.

The modules import each other in this order: ``home``, ``text``, ``changing``.
"""
