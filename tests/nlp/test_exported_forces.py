"""Forces in a program against virtual work in the robot that is exported for MuJoCo, at closed poses away from home.

The exported tree has equality constraints where loops were cut. The null space of their Jacobian has all motions of the
whole robot; what actuators and loads do in each of them is 0.
"""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from builders import EACH_KIND, FEW_KINDS, Array, soaked, starter
from mujoco_robots import null_space
from mujoco_trees import Tree

from screwsynth.models.catalog import SHIPPED
from screwsynth.nlp import Limits, formulate
from screwsynth.nlp.case.limits.forces import ActuatorForce
from screwsynth.nlp.case.loads import Load, Loading
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.formats.solved.mechanism_of import mechanism_of
from screwsynth.nlp.formats.writing.mjcf import mjcf_text

LOADS = 4


@pytest.mark.parametrize("name", soaked([*EACH_KIND, *SHIPPED], (*FEW_KINDS, "delta", *list(SHIPPED)[:1])))
def test_exported_actuators_hold_the_loads_with_the_programs_forces(name: str) -> None:
    rng = np.random.default_rng([5, *name.encode()])
    own = [[tuple(rng.normal(size=3).tolist()) for _ in range(3)] for _ in range(LOADS)]
    loading = Loading(tuple(Load(f"{k}", *parts) for k, parts in enumerate(own)))
    nlp = formulate(replace(starter(name), loading=loading, limits=Limits(ActuatorForce(max=1e9))))
    part = np.array([0.01 if each.name.startswith("q") else 0.1 for each in nlp.program.variables])
    x = close_equations(nlp, closed_start(nlp) + part * rng.uniform(-1, 1, nlp.n) * (nlp.upper - nlp.lower))
    values = dict(zip((each.name for each in nlp.program.constraints), nlp.evaluate(x).g, strict=True))
    exported = mechanism_of(nlp, x)
    actuators = [joint.actuator for joint in exported.joints if joint.actuator]
    found = np.array([[values[f"actuator_force actuator {each} load {k}"] for k in range(LOADS)] for each in actuators])
    backwards = [
        [values[f"actuator_force actuator {each} backwards load {k}"] for k in range(LOADS)] for each in actuators
    ]
    np.testing.assert_array_equal(-found, backwards)

    tree = Tree(mjcf_text(exported.mechanism), exported.size)
    assert tree.open < 1e-12
    state = nlp.program.kernels.robot_state(x, nlp.arguments)
    R, p = (np.array(each) for each in (state.rotation, state.position))
    rates, work = virtual_work(
        tree, [np.concatenate([f, m + np.cross(p.ravel() + R @ at, f)]) for f, m, at in map(np.array, own)]
    )
    assert np.linalg.matrix_rank(rates, 1e-9) == len(actuators)
    np.testing.assert_allclose(rates @ found, -work, rtol=0, atol=1e-10 * np.abs(found).max())


def virtual_work(tree: Tree, wrenches: list[Array]) -> tuple[Array, Array]:
    """Rates (n, a) of the actuators, and work (n, k) of wrenches about the world origin, in each feasible motion."""
    constraints = np.array(tree.data.efc_J).reshape(tree.data.nefc, tree.model.nv)
    linear, angular = np.zeros((3, tree.model.nv)), np.zeros((3, tree.model.nv))
    mujoco.mj_jac(tree.model, tree.data, linear, angular, np.zeros(3), tree.model.body("platform").id)
    motions = null_space(constraints) if len(constraints) else np.eye(tree.model.nv)
    W = np.array(wrenches).T
    return motions[tree.driven].T, motions.T @ (linear.T @ W[:3] + angular.T @ W[3:])
