"""Numbers of any robot over every machine within a tolerance of joint centres; ``legs`` for six straight legs.

``layouts`` has a case over its workspace with errors as variables, ``second_order_change`` bounds of second derivatives
by the errors, ``first_order_change`` numbers with their change as expressions of the pose, ``machine_points`` and
``machine_number`` the smallest value over machines, ``singular_machine`` Newton's method, and ``machines`` all claims.
"""
