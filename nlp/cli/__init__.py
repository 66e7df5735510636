"""The command line: options in, text out, no mathematics. One file a command.

What a command needs is imported when the command runs, so that help is there at once.
"""
