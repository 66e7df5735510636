"""A solved case as a mechanism: links and joints at their places, at one pose of the platform.

The modules in order, each of which imports only those before it: ``words`` (the mechanism in the words of the case,
with frames of its links), ``legs`` (straight legs), ``given`` (robots given joint by joint), ``mechanism_of`` (the
mechanism, with ranges of joints from limits).
"""
