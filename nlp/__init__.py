"""Programs over the robots of :mod:`screwsynth.models`: cases, formulation, solution, evidence and output.

The public names stand in ``__init__.pyi``. Each is imported when it is first used, so that the command line starts at
once.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
