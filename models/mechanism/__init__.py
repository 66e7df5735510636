"""Robots of any topology in numbers: links and joints as a graph, at one configuration.

The modules in order, each of which imports only those before it: ``graph`` (links, joints and couplings).
"""

from .graph import Coupling, Mechanism, MechanismError, MechanismJoint, MechanismLink

__all__ = ["Coupling", "Mechanism", "MechanismError", "MechanismJoint", "MechanismLink"]
