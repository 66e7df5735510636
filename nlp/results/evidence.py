"""Evidence of optimality and proven bounds as data."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from ...models.arrays import first_largest
from ..evidence.optimality import Evidence
from ..program.nlp import Nlp
from ..proof.certificate.certificate import Certificate
from .data import ActiveData, CertificateData, OptimalityData
from .design import unit_of_side
from .jsondata import vector


def optimality_data(nlp: Nlp, evidence: Evidence | None) -> OptimalityData | None:
    """Return the evidence about a point of a program in the case's units; None without any."""
    if evidence is None:
        return None
    units = nlp.case.units
    return OptimalityData.of(
        evidence,
        active=tuple(
            ActiveData.of(
                side,
                value=units.shown(side.value, side.dimension),
                unit=unit_of_side(nlp.case, side.name, side.dimension) or None,
                multiplier=units.per_unit(side.multiplier, side.dimension),
            )
            for side in evidence.active
        ),
        reduced_hessian_eigenvalues=vector(evidence.eigenvalues),
        flat_directions=tuple(_flat(nlp, direction) for direction in evidence.flat),
    )


def _flat(nlp: Nlp, direction: Mapping[str, float]) -> Mapping[str, float]:
    """Return a flat direction in the case's units, the rate of the variable that moves most in its range 1."""
    moved = [(k, each) for k, each in enumerate(nlp.program.variables) if each.name in direction]
    rates = {each.name: nlp.case.units.shown(direction[each.name], each.dimension) for _, each in moved}
    parts = np.array([abs(direction[each.name]) / nlp.scale[k] for k, each in moved])
    most = rates[moved[int(first_largest(parts))][1].name]
    return MappingProxyType({name: rate / most for name, rate in rates.items()})


def certificate_data(certificate: Certificate | None) -> CertificateData | None:
    """Return a proven bound; None without a certificate."""
    return None if certificate is None else CertificateData.of(certificate)


def incumbent_data(certificate: Certificate | None) -> Mapping[str, float] | None:
    """Return the best point known by the names of the program's variables, in the case's units."""
    if certificate is None or certificate.x is None:
        return None
    nlp = certificate.nlp
    variables = zip(nlp.program.variables, certificate.x, strict=True)
    return MappingProxyType(
        {each.name: nlp.case.units.shown(float(value), each.dimension) for each, value in variables}
    )
