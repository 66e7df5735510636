"""First stage of a robot given joint by joint: as it is written, with the form of each value checked.

``forms`` (forms of single values, each refused with its place), ``words`` (all tables of a robot file).
"""
