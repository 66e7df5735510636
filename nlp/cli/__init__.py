"""Command line: options in, text out, no mathematics. One file a command.

A command imports its modules when it runs, so that help appears at once.
"""
