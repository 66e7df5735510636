"""Certificates of a case: incumbent from a solve, branch and bound over the whole search box, and the proof file."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

from ...models import FloatArray
from ...models.shown import Shown
from ...models.whole import Whole
from ..case.case import Case
from ..case.choices import catalogue_dimensions
from ..case.task import Method, Sense
from ..errors import InputError, check_seconds
from ..interruption import is_requested, one_call, reason_of, seconds_left, within
from ..program.formulation import formulate_tasks
from ..proof.boxes.engine import search_tape
from ..proof.boxes.tree import TreeRecord
from ..proof.certificate.branch_and_bound import GAP, CertifyProgress, certify_program
from ..proof.certificate.certificate import Certificate, CertificateStatus
from ..proof.checker.premises import check_minimum, fingerprint, has_both_senses, has_modes, program_of
from ..proof.checker.proof_file import OPTIMUM, Proof, ProofClaim, Statement
from ..proof.enclosure.engine import ENGINE, kernel
from ..proof.statement.standard_form import is_in_home_mode, standard_form
from .certified_choices import prove_choices
from .choices import solve_choices
from .compromise import solution_of_one_task
from .multistart import ProgramSolution, solve_program
from .pose_constraints import with_margin
from .searchjournal import kept_certificate
from .solution import Answer, Solution, interrupted
from .solve import solve, solve_programs
from .status import Status

#: Scope of a bound for a rounded design: only the pose, and parameters that were not rounded, are free.
_ROUNDED = "with the rounded dimensions"
#: Largest part of the time limit of a certificate for its solve.
_SHARE = 0.5
_Solved = TypeVar("_Solved")


class OptionError(InputError):
    """Invalid option of a certificate: value out of range, or not applicable to the case."""


@dataclass(frozen=True)
class CertifyOptions:
    """Options of a certificate.

    Attributes:
        gap: allowed relative difference between bound and incumbent.
        above: value of F to prove as a lower bound, instead of a gap.
        time_limit: seconds for the whole call.
        jobs: number of threads.

    Raises:
        OptionError: a value is outside of its range.
    """

    gap: float = GAP
    above: float | None = None
    time_limit: float | None = None
    jobs: int | None = None

    def __post_init__(self) -> None:
        if not 1e-10 <= self.gap < 1:
            raise OptionError(f"gap: expected a value from 1e-10 to below 1, got {self.gap:g}")
        check_seconds(self.time_limit)
        if self.above is not None and not abs(self.above) < float("inf"):
            raise OptionError(f"above: expected a finite value, got {self.above:g}")


@dataclass(frozen=True, eq=False)
class Certified(Whole, Shown, Answer):
    """A solution with its certificates.

    Attributes:
        solution: the solution.
        tasks: certificate of the separate optimum of each task.
        combined: certificate of the combined program of several tasks; None if the method has no combined program.
        statement: nonlinear program of the case that the proof ``tree`` is about.
        tree: bytes of the proof's tree of boxes; None without ``with_proof``, or without a proved bound.
    """

    solution: Solution
    tasks: tuple[Certificate, ...]
    combined: Certificate | None
    statement: Statement
    tree: bytes | None

    def __repr__(self) -> str:
        proofs = ", ".join(each.status.value for each in self.tasks)
        return f"<Certified {self.solution!r}: {proofs}>"

    @property
    def certificate(self) -> Certificate | None:
        """Certificate of the deciding program: the only task, or the combined program."""
        return self.tasks[0] if self.solution.combination is None else self.combined

    @property
    def certificates(self) -> tuple[Certificate, ...]:
        """All certificates: of the tasks, and of the combined program."""
        return (*self.tasks, *([] if self.combined is None else [self.combined]))

    @property
    def is_proved(self) -> bool:
        """Whether every certificate is proved."""
        return all(each.status is CertificateStatus.PROVED for each in self.certificates)


@one_call
def certify(
    found: Case | Solution,
    *,
    gap: float = GAP,
    above: float | None = None,
    time_limit: float | None = None,
    jobs: int | None = None,
    starts: int | None = None,
    seed: int | None = None,
    all_assemblies: bool = False,
    with_proof: bool = False,
    progress: Callable[[str], CertifyProgress] | None = None,
) -> Certified:
    """Prove bounds on the global optima of a case over its whole search box, for every task and for their combination.

    Args:
        found: case to solve and certify, or its solution.
        gap: allowed relative difference between bound and incumbent.
        above: value of F to prove as a lower bound on the whole box, for the only task of a case.
        time_limit: seconds for the whole call; None for no limit. A solve takes at most half of them, and several
            programs share the rest equally; searches then stop with the bounds that they have reached.
        jobs: number of threads; the result does not depend on it.
        starts: number of starting points; the case's number if left out.
        seed: seed of the starting points; the case's seed if left out.
        all_assemblies: If true, cover all working modes of a robot with given joints; otherwise only the home working
            mode, in which a solve begins. All modes are also covered if the solution is in another mode.
        with_proof: If true, keep the proof of the only task, or of the combined program, for :func:`proof_of`.
        progress: function that returns, for the name of a program, a function to call repeatedly during its search.

    Raises:
        OptionError: an option is outside of its range, or has no meaning for the case.
        UncoveredError: an expression of the case has an operation without an interval rule.
        InputError: the C kernel was not built.
    """
    options = CertifyOptions(gap, above, time_limit, jobs)
    case = found.case if isinstance(found, Solution) else found
    is_rounded = isinstance(found, Solution) and found.rounding is not None
    if with_proof:
        _check_writable(case, is_rounded=is_rounded)
    prove = partial(
        _certify, starts=starts, seed=seed, progress=progress, all_assemblies=all_assemblies, with_proof=with_proof
    )
    with within(time_limit):
        if isinstance(found, Solution) and is_rounded:
            # The rounded design is proved as it is; bounds do not cover what rounding lost.
            own = prove(replace(found, case=found.chosen_case, choice=None, rounding=None), options)
            solution = replace(own.solution, case=case, choice=found.choice, rounding=found.rounding)
            tasks = tuple(replace(each, scope=_ROUNDED) for each in own.tasks)
            combined = None if own.combined is None else replace(own.combined, scope=_ROUNDED)
            return replace(own, solution=solution, tasks=tasks, combined=combined)
        if catalogue_dimensions(case):
            return _certify_choices(found, options, starts, seed, prove)
        return prove(found, options)


def _check_writable(case: Case, *, is_rounded: bool) -> None:
    """Refuse a proof file about a nonlinear program that a case file cannot represent.

    Raises:
        OptionError: a case file cannot represent the program.
    """
    if is_rounded:
        fault = "proof: a proof file refers to the dimensions in the case, but rounded dimensions are not in the case"
        raise OptionError(f"{fault}; give them with --set instead of rounding")
    if catalogue_dimensions(case):
        raise OptionError(
            "proof: each combination of listed values is a separate nonlinear program; give the values with --set"
        )
    if case.is_optimised_everywhere:
        raise OptionError(
            f"proof: not supported with limits.over = {case.limits_over!r}: the case does not contain the poses "
            "from which the bound follows"
        )


def _in_half(solve: Callable[[], _Solved]) -> _Solved:
    """Return the result of a solve with half of the remaining time; the proof has the other half."""
    left = seconds_left()
    with within(None if math.isinf(left) else _SHARE * left):
        return solve()


def _certify(
    found: Case | Solution,
    options: CertifyOptions,
    starts: int | None,
    seed: int | None,
    progress: Callable[[str], CertifyProgress] | None,
    *,
    all_assemblies: bool,
    with_proof: bool,
) -> Certified:
    """Return the certificates of a case without listed values, in the remaining time; see :func:`certify`."""
    above, jobs = options.above, options.jobs
    given = found if isinstance(found, Solution) else None
    case = found.case if isinstance(found, Solution) else found
    if case.is_optimised_everywhere:
        design = given or _in_half(lambda: solve(case, starts=starts, seed=seed, jobs=jobs))
        return _certify_from_poses(design, options, progress)
    several = len(case.tasks) > 1
    if above is not None:
        try:
            check_minimum(case)
        except InputError as error:
            raise OptionError(str(error)) from None
    if several and with_proof and case.method is Method.AVERAGE:
        raise OptionError(
            "proof: no optimum can be proved for averaged tasks: set combine.method to 'weighted-sum' or 'worst-case'"
        )
    nlps = formulate_tasks(case) if given is None else [outcome.own.nlp for outcome in given.outcomes]
    with_mode = not all_assemblies and has_modes(case.model)
    if given is None and nlps[0].n:
        # Refuse a missing kernel, or an operation without a rule, before a solve.
        kernel()
        form = standard_form(replace(nlps[0], in_home_mode=with_mode))
        reason_of(lambda: "" if search_tape(form, is_short=False).op.size else "empty")
    search = case.search.but(starts, seed)

    def certify_one(own: ProgramSolution, name: str, recorder: TreeRecord | None, programs: int = 1) -> Certificate:
        """Certify one of several programs, with an equal share of the remaining time."""
        x, claimed = _incumbent(own)
        in_home_mode = with_mode and (x is None or is_in_home_mode(own.nlp, x) is True)
        program = replace(own.nlp, in_home_mode=True) if in_home_mode else own.nlp
        certified = partial(
            certify_program,
            program,
            x,
            claimed=claimed,
            gap=options.gap,
            above=above,
            jobs=jobs,
            progress=None if progress is None else progress(name),
            recorder=recorder,
        )
        # A journal keeps no trees, and checks within this block whether the search was cut short.
        is_kept = recorder is None
        with within(seconds_left() / programs):
            found = kept_certificate(program, x, certified, gap=options.gap, above=above) if is_kept else certified()
        return _after_solve(found, own, search.starts)

    if not several:
        statement = Statement(is_minimum=above is not None and case.tasks[0].sense is Sense.MAX)
        nlp = replace(nlps[0], sense=Sense.MIN) if statement.is_minimum else nlps[0]
        is_solved = given is not None and nlp is nlps[0]
        own = given.outcomes[0].own if given and is_solved else _in_half(lambda: solve_program(nlp, search, jobs=jobs))
        writer = TreeRecord() if with_proof and nlp.n else None
        certificate = certify_one(own, case.tasks[0].name, writer)
        if certificate.was_beaten and certificate.x is not None:
            own = (
                replace(own, status=Status.INTERRUPTED)  # a better point is known, and there is no time to correct it
                if is_requested()
                else solve_program(nlp, search, first=[certificate.x], jobs=jobs)
            )
        solution = solution_of_one_task(case, own)
        statement = replace(statement, in_home_mode=certificate.nlp.in_home_mode)
        return Certified(solution, (certificate,), None, statement, _complete_tree(writer, certificate))
    may_be_fixed = bool(case.changes)
    solution = given or _in_half(lambda: solve_programs(case, nlps, search, jobs=jobs, may_be_fixed=may_be_fixed))
    count = len(solution.outcomes) + 1  # tasks and the combined program
    separate = tuple(
        certify_one(outcome.own, outcome.task.name, None, count - k) for k, outcome in enumerate(solution.outcomes)
    )
    if solution.combination is None or solution.combination.combined is None:
        return Certified(solution, separate, None, Statement(), None)
    combined = solution.combination.combined
    writer = TreeRecord() if with_proof and combined.nlp.n else None
    certificate = certify_one(combined, case.method.value, writer)
    statement = replace(_combined_statement(case, combined), in_home_mode=certificate.nlp.in_home_mode)
    return Certified(solution, separate, certificate, statement, _complete_tree(writer, certificate))


def _incumbent(own: ProgramSolution) -> tuple[FloatArray | None, float | None]:
    """Return the best point (n,) of a solve and its objective; after an interrupted solve, only if it is an optimum."""
    if own.status.is_answer:
        return own.x, own.F
    return (own.optima[0].x if own.status is Status.INTERRUPTED and own.optima else None), None


def _after_solve(certificate: Certificate, own: ProgramSolution, starts: int) -> Certificate:
    """Return a certificate; if it is unproved and its solve was cut short, its reason says so."""
    if own.status is not Status.INTERRUPTED or certificate.status is CertificateStatus.PROVED:
        return certificate
    done = f"the time for the solve was used up after {len(own.starts)} of {starts} starts"
    return replace(certificate, reason=f"{certificate.reason}; {done}" if certificate.reason else done)


def _certify_choices(
    found: Case | Solution,
    options: CertifyOptions,
    starts: int | None,
    seed: int | None,
    prove: Callable[[Case, CertifyOptions], Certified],
) -> Certified:
    """Return the best combination of a case's listed values, and the bound over all combinations."""
    case = found.case if isinstance(found, Solution) else found
    search = case.search.but(starts, seed)

    def solve_fixed(one: Case) -> Solution:
        if case.is_optimised_everywhere:
            return solve(one, starts=starts, seed=seed, jobs=options.jobs)
        return solve_programs(one, formulate_tasks(one), search, jobs=options.jobs, may_be_fixed=bool(one.changes))

    choice = found.choice if isinstance(found, Solution) else None
    choice = choice or _in_half(lambda: solve_choices(case, solve_fixed).choice)
    if choice is None:
        raise OptionError("values: the case has no parameter with listed values")
    best, values, together = prove_choices(
        case,
        choice,
        lambda one, gap: prove(one, replace(options, gap=gap, time_limit=None)),
        options.gap,
        is_each=options.above is not None,
    )
    changes = found.changes if isinstance(found, Solution) else ()
    chosen = replace(best.solution, case=case, choice=replace(choice, chosen=values), changes=changes)
    closed = (CertificateStatus.PROVED, CertificateStatus.INFEASIBLE)
    if not choice.is_complete and (together is None or together.status not in closed):
        chosen = interrupted(chosen)  # neither the solve nor the proof covers all combinations
    if len(case.tasks) > 1:
        return replace(best, solution=chosen, combined=together)
    return replace(best, solution=chosen, tasks=best.tasks if together is None else (together,))


def _certify_from_poses(
    solution: Solution, options: CertifyOptions, progress: Callable[[str], CertifyProgress] | None
) -> Certified:
    """Return a bound of the optimum with limits over a workspace or along a path, from the poses of the exchange.

    A design that satisfies the limits everywhere satisfies them at these poses: the limits there are those of the case,
    without the margin of the exchange.
    """
    own = solution.outcomes[0].own
    x, claimed = (own.x, own.F) if own.status.is_answer else (None, None)
    nlp = with_margin(own.nlp, 0.0)
    certified = partial(
        certify_program,
        nlp,
        x,
        claimed=claimed,
        gap=options.gap,
        above=options.above,
        jobs=options.jobs,
        progress=None if progress is None else progress(solution.case.tasks[0].name),
    )
    certificate = kept_certificate(nlp, x, certified, gap=options.gap, above=options.above)
    if x is None and options.above is None and certificate.status is CertificateStatus.PROVED:
        # The incumbent satisfies the limits at these poses only, so no design can be compared with the bound.
        certificate = replace(
            certificate,
            status=CertificateStatus.INCOMPLETE,
            x=None,
            incumbent=math.nan,
            reason=f"no design is known that satisfies the limits over the {solution.case.limits_over}",
        )
    return Certified(solution, (certificate,), None, Statement(), None)


def proof_of(certified: Certified, text: str) -> Proof:
    """Return the proof of a certificate, to be written into a proof file.

    Args:
        certified: certificates from :func:`certify` with ``with_proof``.
        text: text of the case file.

    Raises:
        OptionError: no bound was proved.
    """
    certificate = certified.certificate
    if certificate is None or certified.tree is None:
        raise OptionError("proof: no bound was proved, so no file was written")
    nlp = certificate.nlp
    is_empty = certificate.status is CertificateStatus.INFEASIBLE
    bound = None if is_empty else certificate.bound_of_tree
    graph = fingerprint(program_of(nlp.case, certified.statement))
    claim = ProofClaim(OPTIMUM, "", "program", bound, graph, certified.tree)
    return Proof(text, nlp.case.name, certified.statement, (claim,))


def _complete_tree(writer: TreeRecord | None, certificate: Certificate) -> bytes | None:
    """Return the bytes of the tree of a complete proof; None if nothing is proved or recorded."""
    complete = certificate.status in (CertificateStatus.PROVED, CertificateStatus.INFEASIBLE)
    # A program with a single point needs no search, and has no tree.
    return writer.tree() if writer is not None and complete and certificate.engine == ENGINE else None


def _combined_statement(case: Case, combined: ProgramSolution) -> Statement:
    """Return the proof statement about the combined program of several tasks."""
    epigraph = combined.nlp.program.places.epigraph
    if epigraph is None or not has_both_senses(case):
        return Statement()
    return Statement(best=tuple(float(combined.nlp.arguments[place]) for place in epigraph.best))
