"""Descriptions of robots for other programs: of a solved case as a mechanism, and files in their formats.

The modules in order, each of which imports only those before it: ``chains`` (limbs as chains of elementary joints),
``jointchains`` (limbs of a robot given joint by joint), ``legchains`` (straight legs), ``placing`` (chains closed at a
pose), ``linkframes`` (frames of links), ``assembled`` (links and joints at a configuration), ``ranges`` (ranges of
joints from limits), ``mechanism_of`` (a solved case as a mechanism), the room ``writing`` (files of a mechanism), and
``export`` (files of a solved case).
"""
