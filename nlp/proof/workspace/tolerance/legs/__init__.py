"""Every machine of six straight legs within a tolerance of joint centres.

``worst`` and ``worst_plates`` have the worst machine at a pose, ``claims`` and ``limits`` claims about all machines,
and ``singular_values`` bounds of their singular values.
"""
