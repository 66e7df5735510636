"""Certificates of a case as a result: the types and their construction."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ..case.task import Sense
from .data import CertificateData
from .evidence import certificate_data, incumbent_data
from .jsondata import Absent, Inline, JsonObject
from .parts import HeadData, VersionsData
from .point import head_data, stated_pose_notice, versions

if TYPE_CHECKING:
    from ..solver.certified import Certified


class CertifiedTaskData(JsonObject):
    """A task by itself and its certificate.

    Attributes:
        name: of the task.
        sense: whether F is maximised or minimised.
        certificate: the proven bound.
        point: the best point known, by the names of the program's variables; null where there is none.
    """

    name: str
    sense: Sense
    certificate: CertificateData | None
    point: Mapping[str, float] | None


class CertifiedResult(JsonObject):
    """Result of certifying a case.

    Attributes:
        head: the case.
        certificate: of the one task, or of the program that combines several; null where there is no such program.
        point: the best point known, by the names of the program's variables; null where there is none.
        tasks: each task by itself.
        notice: that the limits are taken at the stated pose alone, where the case has them over its workspace; else
            absent.
        versions: of the programs.
    """

    head: Inline[HeadData]
    certificate: CertificateData | None
    point: Mapping[str, float] | None
    tasks: tuple[CertifiedTaskData, ...]
    notice: Absent[str]
    versions: VersionsData


def certified_of(certified: "Certified") -> CertifiedResult:
    """Return the proven bounds of a case: of every task, and of the combined program where there is one."""
    case = certified.tasks[0].nlp.case
    return CertifiedResult(
        head=head_data(case),
        certificate=certificate_data(certified.certificate),
        point=incumbent_data(certified.certificate),
        tasks=tuple(
            CertifiedTaskData(
                name=task.name, sense=each.nlp.sense, certificate=certificate_data(each), point=incumbent_data(each)
            )
            for task, each in zip(case.tasks, certified.tasks, strict=True)
        ),
        notice=stated_pose_notice(case),
        versions=versions(),
    )
