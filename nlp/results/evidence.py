"""Evidence of optimality and proved bounds as data; the result of ``certify``."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from ...models.arrays import first_largest
from ..case.task import Sense
from ..evidence.optimality import Evidence
from ..program.nlp import Nlp
from ..proof.certificate.certificate import Certificate
from ..system.jsonvalues import Absent, Inline, JsonObject
from .choices import ChoiceData, choice_data
from .data import CertificateData
from .objective import ObjectiveData, certified_objective
from .parts import HeadData, VersionsData
from .point import head_data, stated_pose_notice, versions

if TYPE_CHECKING:
    from ..solver.certified import Certified


def optimality_of(nlp: Nlp, evidence: Evidence | None) -> Evidence | None:
    """Return the evidence about a point of a program in the case's units; None without evidence."""
    if evidence is None:
        return None
    return Evidence.of(evidence, nlp.case.units, flat=tuple(_flat(nlp, direction) for direction in evidence.flat))


def _flat(nlp: Nlp, direction: Mapping[str, float]) -> Mapping[str, float]:
    """Return a flat direction in the case's units; the variable that moves most within its range has the rate 1."""
    moved = [(k, each) for k, each in enumerate(nlp.program.variables) if each.name in direction]
    rates = {each.name: nlp.case.units.shown(direction[each.name], each.dimension) for _, each in moved}
    parts = np.array([abs(direction[each.name]) / nlp.scale[k] for k, each in moved])
    most = rates[moved[int(first_largest(parts))][1].name]
    return MappingProxyType({name: rate / most for name, rate in rates.items()})


def certificate_data(certificate: Certificate | None) -> CertificateData | None:
    """Return a proved bound; None without a certificate."""
    return None if certificate is None else CertificateData.of(certificate)


def incumbent_data(certificate: Certificate | None) -> Mapping[str, float] | None:
    """Return the value of each variable at the incumbent, by name, in the case's units."""
    if certificate is None or certificate.x is None:
        return None
    nlp = certificate.nlp
    variables = zip(nlp.program.variables, certificate.x, strict=True)
    return MappingProxyType(
        {each.name: nlp.case.units.shown(float(value), each.dimension) for each, value in variables}
    )


class CertifiedTaskData(JsonObject):
    """Certificate of a task.

    Attributes:
        name: name of the task.
        sense: sense of the optimisation: F is maximised or minimised.
        certificate: proved bound of the task's F.
        point: incumbent, by the names of the program's variables; null if no feasible point is known.
    """

    name: str
    sense: Sense
    certificate: CertificateData | None
    point: Mapping[str, float] | None


class CertifiedResult(JsonObject):
    """Result of certifying a case.

    Attributes:
        head: the case.
        certificate: proved bound of the task, or of the program that combines tasks; null without such a program.
        objective: objective, if it is not F at the stated poses; otherwise absent.
        point: incumbent, by the names of the program's variables; null if no feasible point is known.
        tasks: certificates of the separate tasks.
        choice: choice among listed values, at the best known combination; absent without listed values.
        notice: notice that limits over a workspace or path are taken at the stated pose only; otherwise absent.
        versions: versions of the software.
    """

    head: Inline[HeadData]
    certificate: CertificateData | None
    objective: Absent[ObjectiveData]
    point: Mapping[str, float] | None
    tasks: tuple[CertifiedTaskData, ...]
    choice: Absent[ChoiceData]
    notice: Absent[str]
    versions: VersionsData


def certified_of(certified: "Certified") -> CertifiedResult:
    """Return the proved bounds of every task and, if tasks are combined, of the combined program."""
    case = certified.solution.chosen_case
    return CertifiedResult(
        head=head_data(case),
        certificate=certificate_data(certified.certificate),
        objective=certified_objective(certified),
        point=incumbent_data(certified.certificate),
        tasks=tuple(
            CertifiedTaskData(
                name=task.name, sense=each.nlp.sense, certificate=certificate_data(each), point=incumbent_data(each)
            )
            for task, each in zip(case.tasks, certified.tasks, strict=True)
        ),
        choice=choice_data(certified.solution),
        notice=None if case.is_optimised_everywhere else stated_pose_notice(case),
        versions=versions(),
    )
