"""Every machine within a tolerance of joint centres.

``worst`` and ``worstplates`` have the worst machine at a pose, ``builtclaims`` claims about all
machines, ``builtrank`` singular machines, and ``builtsingular`` bounds of singular values.
"""
