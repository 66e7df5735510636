"""Third stage of a robot given joint by joint: at any pose, with loops opened and unknowns that close them.

``cut`` (the joint at which a limb's loop is opened), ``opened`` (the opened limb: current screws and equations),
``modes`` (signs of the home assembly mode), ``resistance`` (rows and members of a limb), ``states`` (joint coordinates
from home, and links), ``placed`` (joints for drawings), ``loops`` (independent loop equations), ``network`` (nested
loops), ``nested`` (their members and actuators).
"""
