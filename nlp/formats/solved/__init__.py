"""Solved cases as mechanisms: links and joints at one pose of the platform.

The modules import each other in this order: ``words`` (names of joints, frames of links), ``legs`` (straight legs),
``given`` (robots given joint by joint), ``mechanism_of`` (mechanisms with joint ranges from limits).
"""
