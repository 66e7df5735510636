"""Six straight legs over a box of poses, beside what all robots have.

The modules import each other in this order: ``rows`` (forms of the rows), ``inverse`` (of the rows over boxes),
``exact`` (signs of determinants without rounding), ``signs`` (singular poses by these signs).
"""
