"""First stage of a robot given joint by joint: as it is written, with the form of each value checked.

``forms`` (forms of single values), ``words`` (all tables of a robot file).
"""
