"""A solved case as a mechanism: links and joints at their places, at one pose of the platform.

The modules in order, each of which imports only those before it: ``chains`` (limbs as chains of elementary joints),
``jointchains`` (limbs of a robot given joint by joint), ``legchains`` (straight legs), ``placing`` (chains closed at a
pose), ``linkframes`` (frames of links), ``assembled`` (links and joints at a configuration), ``ranges`` (ranges of
joints from limits), ``mechanism_of`` (the mechanism).
"""
