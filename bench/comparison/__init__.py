"""What ``make bench`` measures, one section in each module, and the page that it writes.

In order: machine, shares, problems, judging, attempts, workers, race; numpyrobot, evaluation; certificates; growth;
summary, store, tables, racetables, page.
"""

import os

# All methods get one core. NumPy's library of linear algebra reads this when it is loaded.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
