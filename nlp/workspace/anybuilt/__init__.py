"""Numbers of any robot over every machine within a tolerance of joint centres.

``layouts`` has a case over its workspace with errors as variables, ``secondorder`` bounds of second derivatives by the
errors, ``firstorder`` numbers with their change as expressions of the pose, and ``machines`` all claims.
"""
