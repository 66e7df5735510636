"""Cases in which a bound could be stated as proven and be wrong: each was found by reading the search as an opponent."""

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from screwsynth.nlp import Free, Nlp, Sense, load_case
from screwsynth.nlp.certificate.branchandbound import certify_program
from screwsynth.nlp.certificate.certificate import CertificateStatus
from screwsynth.nlp.certificate.kinks import without_ties
from screwsynth.nlp.program.assembly import assemble
from screwsynth.nlp.program.layout import lay_out
from dataclasses import replace


def test_derivatives_with_kinks_are_those_of_casadi_off_the_kinks() -> None:
    """A node of CasADi's that nothing holds gives its address to another, which must not pass for a comparison."""
    rng = np.random.default_rng(0)
    x = SX.sym("x", 4)
    errors = []
    for _ in range(150):

        def term() -> SX:
            i, j = (int(k) for k in rng.integers(4, size=2))
            return (x[i] * x[j], ca.fmax(x[i] * x[j], 0.3), ca.fmin(x[i], 0.1), ca.fmax(x[i], -0.2))[rng.integers(4)]

        slopes = ca.jacobian(ca.vertcat(*[term() * term() + term() + term() + term() for _ in range(2)]), x)
        errors.append(ca.sumsqr(slopes - without_ties(slopes, x)))
    points = np.random.default_rng(5).uniform(-1, 1, (4, 20))
    found = ca.Function("errors", [x], [ca.vertcat(*errors)]).map(20)(points).full()
    assert found.max() < 1e-20


def program(expression: object, ends: tuple[float, float] = (-3.0, 3.0)) -> Nlp:
    """Return the minimisation of an expression of two numbers within ends; those are a platform's position."""
    case = load_case("hexapod-machining")
    case = replace(case, position=(Free(*ends), Free(*ends), 20.0), limits=(), further=(), displacements=case.displacements[:1])
    layout = lay_out(case, case.tasks[:1])
    layout = replace(layout, constraints=(), constant_limits=(), families=())
    return assemble(layout, expression(*ca.vertsplit(layout.table.variables_vector)), Sense.MIN)


def test_parts_of_a_claim_by_limbs_add_up() -> None:
    """The first limb is closed while the second one is far from its best: both together need more than the claim has."""
    nlp = program(lambda x, y: -2 * ca.exp(-((50 * (x - 0.737)) ** 2)) + y**2)
    found = certify_program(nlp, np.array([2.5, 3.0]), above=-1.0)
    print(found.statement, found.bound, found.status)
    assert found.status is not CertificateStatus.PROVED
