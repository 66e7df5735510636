"""From a case to its certificates: solve for an incumbent, hand it to the search of the whole box, keep the proof."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from ..case.case import Case
from ..case.settings import Search
from ..case.task import Method, Sense
from ..certificate.bounding import search_tape
from ..certificate.branchandbound import GAP, CertifyProgress, certify
from ..certificate.certificate import Certificate, CertificateStatus
from ..certificate.proof import Proof, Statement, fingerprint
from ..certificate.proofwriter import ProofWriter
from ..certificate.standardform import standard_form
from ..errors import InputError
from ..program.epigraph import formulate_worst
from ..program.formulation import formulate, formulate_each, formulate_weighted
from ..program.nlp import Nlp
from .compromise import Compromise, solve_tasks
from .multistart import Solution, solve_nlp


@dataclass(frozen=True)
class CertifyOptions:
    """What is asked of a certificate.

    Attributes:
        gap: part of the incumbent that the bound may be off by.
        above: prove that F is above this value instead.
        time_limit: seconds for each program.
        jobs: threads.
    """

    gap: float = GAP
    above: float | None = None
    time_limit: float | None = None
    jobs: int | None = None


@dataclass(frozen=True, eq=False)
class Certified:
    """A solve and what is proved of it.

    Attributes:
        solution: of the one task, or the compromise of several.
        tasks: a certificate for each task by itself.
        combined: for the combined program of several tasks, where the method has one.
        statement: which program ``proved`` is about.
        tree: the proof's nodes; None when none was asked for or there is none.
    """

    solution: Solution | Compromise
    tasks: tuple[Certificate, ...]
    combined: Certificate | None
    statement: Statement
    tree: bytes | None

    @property
    def certificate(self) -> Certificate | None:
        """The one that the case as a whole asks for: that of its only task, or of the combined program."""
        return self.tasks[0] if isinstance(self.solution, Solution) else self.combined

    @property
    def is_proved(self) -> bool:
        """Whether everything that was asked for is proved."""
        every = [*self.tasks, *([] if self.combined is None else [self.combined])]
        return all(each.status is CertificateStatus.PROVED for each in every)


def certify_case(
    case: Case,
    wanted: CertifyOptions,
    search: Search,
    *,
    with_proof: bool = False,
    progress: Callable[[str], CertifyProgress] | None = None,
) -> Certified:
    """Solve a case and certify what was found.

    Args:
        case: the case.
        wanted: what is asked for.
        search: how the incumbent is searched for.
        with_proof: keep the proof of the case's one task, or of its combined program.
        progress: gives what is called now and then, from the name of what is searched.

    Raises:
        InputError: a proof, or F above a value, is asked for where there is no one program.
        UncoveredError: the case's expressions hold an operation without a rule.
    """
    several = len(case.tasks) > 1
    if several and wanted.above is not None:
        raise InputError("--above: is for a case with one task")
    if several and with_proof and case.method is Method.AVERAGE:
        raise InputError("--proof: a case whose tasks are averaged has no one program to prove something of")
    for nlp in formulate_each(case)[:1]:
        if nlp.n:
            search_tape(standard_form(nlp))  # what is not covered is refused before anything is solved

    def proved(nlp: Nlp, solution: Solution, name: str, recorder: ProofWriter | None) -> Certificate:
        x, claimed = (solution.x, solution.F) if solution.status.is_answer else (None, None)
        return certify(
            nlp,
            x,
            claimed=claimed,
            gap=wanted.gap,
            above=wanted.above,
            time_limit=wanted.time_limit,
            jobs=wanted.jobs,
            progress=None if progress is None else progress(name),
            recorder=recorder,
        )

    if not several:
        statement = Statement(minimise=wanted.above is not None)
        nlp = program_of(case, statement)
        solution = solve_nlp(nlp, search, jobs=wanted.jobs)
        writer = _writer(nlp) if with_proof else None
        certificate = proved(nlp, solution, case.tasks[0].name, writer)
        if certificate.was_beaten and certificate.x is not None:
            solution = solve_nlp(nlp, search, first=[certificate.x], jobs=wanted.jobs)
        return Certified(solution, (certificate,), None, statement, _tree(writer, certificate))
    compromise = solve_tasks(case, starts=search.starts, seed=search.seed, jobs=wanted.jobs)
    own = [proved(outcome.own.nlp, outcome.own, outcome.task.name, None) for outcome in compromise.outcomes]
    combined, writer, statement = None, None, Statement()
    if compromise.combined is not None:
        statement = _statement(compromise)
        nlp = compromise.combined.nlp
        writer = _writer(nlp) if with_proof else None
        combined = proved(nlp, compromise.combined, case.method.value, writer)
    tree = None if combined is None else _tree(writer, combined)
    return Certified(compromise, tuple(own), combined, statement, tree)


def program_of(case: Case, statement: Statement) -> Nlp:
    """The program of a case that a proof is about.

    Raises:
        InputError: the case has no such program.
    """
    if statement.kind == "task":
        if not 0 <= statement.task < len(case.tasks):
            raise InputError(f"the proof is for task {statement.task + 1}, which the case does not have")
        nlp = formulate(case, statement.task)
        return replace(nlp, sense=Sense.MIN) if statement.minimise else nlp
    if not len(case.tasks) == len(statement.weights) > 1:
        raise InputError("the proof is for several tasks, and not for those of the case")
    if statement.kind == "weighted-sum":
        return formulate_weighted(case, statement.weights)
    return formulate_worst(case, statement.weights, statement.best, statement.ceiling)


def proof_of(certified: Certified, text: str) -> Proof:
    """The proof that goes with a certificate.

    Args:
        certified: made with ``with_proof``.
        text: the case file's text.

    Raises:
        InputError: nothing was proved.
    """
    certificate = certified.certificate
    if certificate is None or certified.tree is None:
        raise InputError("--proof: nothing was proved, so nothing is written")
    nlp = certificate.nlp
    bound = None if certificate.status is CertificateStatus.INFEASIBLE else -nlp.sign * certificate.bound
    return Proof(text, nlp.case.name, certified.statement, fingerprint(nlp), bound, certified.tree)


def _writer(nlp: Nlp) -> ProofWriter | None:
    return ProofWriter(len(standard_form(nlp).functions)) if nlp.n else None


def _tree(writer: ProofWriter | None, certificate: Certificate) -> bytes | None:
    settled = certificate.status in (CertificateStatus.PROVED, CertificateStatus.INFEASIBLE)
    return writer.tree() if writer is not None and settled else None


def _statement(compromise: Compromise) -> Statement:
    weights = tuple(outcome.task.weight for outcome in compromise.outcomes)
    if compromise.method is Method.WEIGHTED_SUM or compromise.combined is None:
        return Statement("weighted-sum", weights=weights)
    nlp = compromise.combined.nlp
    epigraph = nlp.program.places.epigraph
    if epigraph is None:
        raise TypeError("the program of a worst case has an epigraph")
    best = tuple(float(nlp.arguments[place]) for place in epigraph.best)
    return Statement("worst-case", weights=weights, best=best, ceiling=float(nlp.arguments[epigraph.ceiling]))
