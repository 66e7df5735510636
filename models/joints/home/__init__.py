"""Second stage of a robot given joint by joint: at home, as expressions of its dimensions.

``motion`` (displacements and screws as symbols), ``chain`` (joints, limbs and links), ``mechanisms`` (the robot in
numbers), ``generic`` (ranks at random dimensions), ``faults`` (degenerate joints and almost parallel axes),
``straight`` (limbs that are straight legs).
"""
