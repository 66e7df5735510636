"""Numbers of any robot over every machine within a tolerance of joint centres.

``leg_errors`` has errors of six straight legs, ``second_order_change`` bounds of second derivatives by the errors,
``machine_number`` the smallest value over machines, by boxes of poses, and ``machines`` all claims.
"""
