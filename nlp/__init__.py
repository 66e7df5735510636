"""Programs over the robots of :mod:`screwsynth.models`: cases, formulation, solution, evidence and output."""
