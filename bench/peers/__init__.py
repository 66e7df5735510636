"""Methods that are compared: one call of a library in each module, all behind the interface of :mod:`.interface`."""

from __future__ import annotations

from . import (
    cma_es,
    nlopt_global,
    nlopt_local,
    pygmo_hopping,
    pygmo_sade,
    scipy_annealing,
    scipy_direct,
    scipy_evolution,
    scipy_shgo,
    scipy_slsqp,
    scipy_trust,
    screwsynth_c,
    screwsynth_ipopt,
    screwsynth_solve,
)
from .interface import Peer

_MODULES = (
    screwsynth_solve,
    screwsynth_ipopt,
    screwsynth_c,
    scipy_slsqp,
    scipy_trust,
    nlopt_local,
    scipy_evolution,
    scipy_annealing,
    scipy_shgo,
    scipy_direct,
    nlopt_global,
    cma_es,
    pygmo_sade,
    pygmo_hopping,
)


def all_peers() -> tuple[Peer, ...]:
    """Return all peers, in the order of tables."""
    return tuple(peer for module in _MODULES for peer in module.PEERS)
