"""Numbers of any robot over every machine within a tolerance of joint centres.

The modules import each other in this order: ``second_order_change`` (bounds of second derivatives by the errors),
``machines`` (all claims).
"""
