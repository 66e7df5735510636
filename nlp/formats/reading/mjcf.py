"""Reader of MJCF by MuJoCo's parser."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree.ElementTree import Element, tostring

import numpy as np

from ....models.mechanism import Coupling, MechanismJoint
from ...errors import InputError
from ..extra import required
from ..frames import Frame, rotation_from_quaternion
from .description import Body, Closing, Description, LoopClosure, common_name, unique_name
from .mjcfclean import CleanModel, clean_model

if TYPE_CHECKING:
    from ....models.mechanism.graph import ElementaryKind


def read_mjcf(root: Element, path: Path, keyframe: str = "") -> Description:
    """Return the robot of a MuJoCo model, at a keyframe or at the reference configuration ``qpos0``.

    Args:
        root: root element of the main file.
        path: path of the main file.
        keyframe: name of the keyframe, or its number from 1; empty for ``qpos0``.

    Raises:
        InputError: MuJoCo is not installed, or the model cannot be read.
    """
    mujoco = required("mujoco", "MJCF files")
    clean = clean_model(root, path, keyframe)
    warnings: list[str] = []
    mujoco.set_mju_user_warning(warnings.append)
    try:
        with _quiet():
            model = mujoco.MjModel.from_xml_string(tostring(clean.root, encoding="unicode"))
            data = mujoco.MjData(model)
            if keyframe:
                mujoco.mj_resetDataKeyframe(model, data, 0)
            mujoco.mj_kinematics(model, data)
    except (ValueError, mujoco.FatalError) as error:
        reason = str(error).strip().splitlines() or ["no reason given"]
        raise InputError(f"{path}: MuJoCo cannot read it: {reason[0].removeprefix('XML Error: ')}") from None
    finally:
        mujoco.set_mju_user_warning(None)
    name, notes = root.get("model") or path.stem, (*clean.notes, *warnings)
    return _Reader(mujoco, model, data, str(path)).description(name, clean, notes)


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress standard output and error of the process, to which MuJoCo writes."""
    with tempfile.TemporaryFile() as lost:
        kept = [(descriptor, os.dup(descriptor)) for descriptor in (1, 2)]
        try:
            for descriptor, _ in kept:
                os.dup2(lost.fileno(), descriptor)
            yield
        finally:
            for descriptor, copy in kept:
                os.dup2(copy, descriptor)
                os.close(copy)


class _Reader:
    """Reader of a compiled model at a configuration."""

    def __init__(self, mujoco: Any, model: Any, data: Any, source: str) -> None:  # noqa: ANN401 - no stubs
        self.mujoco, self.model, self.data, self.source = mujoco, model, data, source
        self.taken: set[str] = set()
        self.body_names = self._names(model.nbody, model.body, "body")
        self.taken = set()
        self.joint_names = self._names(model.njnt, model.joint, "joint")
        self.mocap = {self.body_names[k] for k in range(model.nbody) if model.body_mocapid[k] >= 0}
        self.bodies: list[Body] = []
        self.joints: list[MechanismJoint] = []
        self.notes: list[str] = []

    def _names(self, count: int, of: Any, kind: str) -> list[str]:  # noqa: ANN401 - no stubs
        """Return a unique name for each of ``count`` elements; elements without a name are numbered."""
        given = [str(of(k).name) for k in range(count)]
        names = []
        for k, name in enumerate(given):
            chosen = name or unique_name(f"{kind}_{k}", {*given, *self.taken})
            self.taken.add(chosen)
            names.append(chosen)
        return names

    def description(self, name: str, clean: CleanModel, notes: tuple[str, ...]) -> Description:
        """Return the description of the robot."""
        self.bodies.append(Body(self.body_names[0], "", Frame()))
        for k in range(1, self.model.nbody):
            self._add_body(k)
        closures, couplings, offsets = self._equalities()
        driven = [*clean.driven, *(self._tendon_motor(each, couplings) for each in clean.tendons)]
        known = {joint.name for joint in self.joints}
        for joint in driven:
            if joint not in known:
                raise InputError(
                    f"{self.source}: an actuator drives {joint!r}, which is not a hinge or slide of the model"
                )
        return Description(
            name=name,
            source=self.source,
            root=self.body_names[0],
            bodies=tuple(self.bodies),
            joints=tuple(self.joints),
            closures=tuple(closures),
            couplings=tuple(couplings),
            offsets=offsets,
            driven=frozenset(driven),
            frames=self._sites(),
            keyframes=clean.keyframes,
            notes=(*notes, *self.notes),
        )

    def _add_body(self, k: int) -> None:
        """Add a body with its joints, with massless bodies between several joints of a body."""
        model, data, mujoco = self.model, self.data, self.mujoco
        name, parent = self.body_names[k], self.body_names[model.body_parentid[k]]
        place = Frame(data.xpos[k].copy(), data.xmat[k].reshape(3, 3).copy())
        kinds: dict[int, ElementaryKind] = {
            int(mujoco.mjtJoint.mjJNT_HINGE): "R",
            int(mujoco.mjtJoint.mjJNT_SLIDE): "P",
            int(mujoco.mjtJoint.mjJNT_BALL): "S",
        }
        numbers = range(model.body_jntadr[k], model.body_jntadr[k] + model.body_jntnum[k])
        if any(model.jnt_type[j] == int(mujoco.mjtJoint.mjJNT_FREE) for j in numbers):
            self.bodies.append(Body(name, "", place))
            return
        if not numbers:
            fixed = unique_name(f"{name} fixed", set(self.joint_names))
            self.joints.append(MechanismJoint(fixed, "weld", parent, name, place.position))
            self.bodies.append(Body(name, parent, place))
            return
        for j in numbers:
            moved = (
                name if j == numbers[-1] else unique_name(f"{name} behind {self.joint_names[j]}", set(self.body_names))
            )
            kind = kinds[int(model.jnt_type[j])]
            axis = np.zeros(3) if kind == "S" else data.xaxis[j].copy()
            limits = None
            if model.jnt_limited[j] and kind != "S":
                low, high = model.jnt_range[j] - data.qpos[model.jnt_qposadr[j]]
                limits = (float(low), float(high))
            point = data.xanchor[j].copy()
            self.joints.append(MechanismJoint(self.joint_names[j], kind, parent, moved, point, axis, range=limits))
            self.bodies.append(Body(moved, parent, place))
            parent = moved

    def _sites(self) -> dict[str, tuple[str, Frame]]:
        """Return the body and the frame, in body coordinates, of each named site."""
        found = {}
        for k in range(self.model.nsite):
            if self.model.site(k).name:
                found[str(self.model.site(k).name)] = self._site(k)
        return found

    def _site(self, k: int) -> tuple[str, Frame]:
        """Return the body of a site, and the frame of the site in body coordinates."""
        rotation = rotation_from_quaternion(self.model.site_quat[k])
        return self.body_names[self.model.site_bodyid[k]], Frame(self.model.site_pos[k].copy(), rotation)

    def _equalities(self) -> tuple[list[LoopClosure], list[Coupling], dict[str, float]]:
        """Return the equalities of the model: joints that close loops, couplings, and residuals of the couplings."""
        model, kinds = self.model, self.mujoco.mjtEq
        closures: list[LoopClosure] = []
        couplings: list[Coupling] = []
        offsets: dict[str, float] = {}
        taken = set(self.joint_names)
        for k in range(model.neq):
            name = unique_name(self._name_of_equality(k), taken)
            is_coupling = model.eq_type[k] in (int(kinds.mjEQ_JOINT), int(kinds.mjEQ_TENDON))
            closure = None if is_coupling else self._closure(k, name)
            if not model.eq_active0[k]:
                self.notes.append(f"equality {name} was omitted: it is not active")
            elif closure is not None and {closure.first, closure.second} & self.mocap:
                self.notes.append(f"equality {name} was omitted: it has a mocap body, which only a simulation moves")
            elif closure is not None:
                closures.append(closure)
                taken.add(name)
            else:
                coupling, offset = self._coupling(k, name)
                couplings.append(coupling)
                offsets[name] = offset
                taken.add(name)
        return closures, couplings, offsets

    def _name_of_equality(self, k: int) -> str:
        """Return the name of an equality; without one, the common prefix of the names of its sites."""
        given = str(self.model.equality(k).name)
        if given or self.model.eq_objtype[k] != int(self.mujoco.mjtObj.mjOBJ_SITE):
            return given or f"equality_{k + 1}"
        names = [str(self.model.site(each).name) for each in (self.model.eq_obj1id[k], self.model.eq_obj2id[k])]
        return common_name(names) or f"equality_{k + 1}"

    def _closure(self, k: int, name: str) -> LoopClosure:
        """Return the joint of a connect or weld."""
        model = self.model
        first, second = model.eq_obj1id[k], model.eq_obj2id[k]
        is_weld = model.eq_type[k] == int(self.mujoco.mjtEq.mjEQ_WELD)
        closing = Closing.WELD if is_weld else Closing.BALL
        if model.eq_objtype[k] == int(self.mujoco.mjtObj.mjOBJ_SITE):
            (one, one_frame), (other, other_frame) = self._site(first), self._site(second)
        else:
            one, other, numbers = self.body_names[first], self.body_names[second], model.eq_data[k]
            if is_weld:
                # eq_data has the anchor on the second body, then on the first body, then the relative rotation.
                one_frame = Frame(numbers[3:6].copy(), rotation_from_quaternion(numbers[6:10]))
                other_frame = Frame(numbers[0:3].copy())
            else:
                one_frame, other_frame = Frame(numbers[0:3].copy()), Frame(numbers[3:6].copy())
        return LoopClosure(name, closing, one, other, one_frame, other_frame)

    def _coupling(self, k: int, name: str) -> tuple[Coupling, float]:
        """Return the linear relation of an equality of joints or fixed tendons, and its value at the configuration.

        Coordinates of the relation are relative to the configuration; those of MuJoCo's polynomial to ``qpos0``.
        """
        model = self.model
        is_tendon = model.eq_type[k] == int(self.mujoco.mjtEq.mjEQ_TENDON)
        sides = [int(each) for each in (model.eq_obj1id[k], model.eq_obj2id[k]) if each >= 0]
        constant, slope, *higher = (float(each) for each in model.eq_data[k][:5])
        if any(higher) and len(sides) == 2:
            fault = "must be linear: its polycoef may have a constant and a factor, followed by zeros"
            raise InputError(f"{self.source}: equality {name} of {'tendons' if is_tendon else 'joints'}: {fault}")
        total: dict[int, float] = {}
        for side, sign in zip(sides, (1.0, -slope), strict=False):
            for joint, factor in self._pulls(side) if is_tendon else [(side, 1.0)]:
                total[joint] = total.get(joint, 0.0) + sign * factor
        if is_tendon:
            total = {joint: factor for joint, factor in total.items() if factor}
        factors = tuple((self.joint_names[j], value) for j, value in total.items())
        moved = [float(self.data.qpos[at] - model.qpos0[at]) for at in (model.jnt_qposadr[j] for j in total)]
        return Coupling(name, factors), sum(f * q for (_, f), q in zip(factors, moved, strict=True)) - constant

    def _pulls(self, tendon: int) -> list[tuple[int, float]]:
        """Return the joints of a fixed tendon, each with the tendon's length per unit of its coordinate."""
        start = int(self.model.tendon_adr[tendon])
        steps = range(start, start + int(self.model.tendon_num[tendon]))
        return [(int(self.model.wrap_objid[k]), float(self.model.wrap_prm[k])) for k in steps]

    def _tendon_motor(self, name: str, couplings: list[Coupling]) -> str:
        """Return the name of the joint that the actuator of a fixed tendon drives.

        For a tendon of several joints, a motor joint and a link are added to the model, on the link before the first of
        these joints. A coupling makes the length of the tendon the coordinate of the motor.

        Args:
            name: name of the tendon.
            couplings: couplings of the robot; the coupling of the motor is added.
        """
        pulls = [(joint, factor) for joint, factor in self._pulls(self.model.tendon(name).id) if factor]
        if not pulls:
            fault = f"an actuator drives the tendon {name!r}, which moves no joint: all its coef are 0"
            raise InputError(f"{self.source}: {fault}")
        if len(pulls) == 1:
            only = self.joint_names[pulls[0][0]]
            self.notes.append(f"the actuator of tendon {name} drives only joint {only}; its rate is the rate of {only}")
            return only
        names = {each.name: each for each in self.joints}
        first = names[self.joint_names[pulls[0][0]]]
        taken = {*names, *(each.name for each in couplings)}
        motor = unique_name(name, taken)
        rotor = unique_name(f"{motor} rotor", {body.name for body in self.bodies})
        inner = next(body for body in self.bodies if body.name == first.inner)
        self.bodies.append(Body(rotor, inner.name, inner.place))
        self.joints.append(MechanismJoint(motor, first.kind, inner.name, rotor, first.point, first.axis))
        factors = ((motor, 1.0), *((self.joint_names[joint], -factor) for joint, factor in pulls))
        couplings.append(Coupling(unique_name(f"{motor} tendon", taken), factors))
        became = f"the actuator of tendon {name} became joint {motor}"
        self.notes.append(f"{became}; its coordinate is the length of the tendon")
        return motor
