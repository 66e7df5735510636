"""Joints of robots at many poses: this program beside MuJoCo and pinocchio, in one run.

    python -P bench/inverse.py [poses]

MuJoCo and pinocchio get a Stewart platform of universal joints, slides and ball joints with the same joint centres, and
close its loops at each pose by Newton's method on the eighteen joints of its legs, from those of the pose before; their
own functions give positions and Jacobians, and NumPy solves. Times are CPU times of this process, the best of three,
because the machine may be shared. The leg lengths of all must be equal.
"""

import sys
import time
from collections.abc import Callable

import numpy as np

from screwsynth.nlp import Case, Rotation, Task, build_model, inverse, load_case
from screwsynth.nlp.proof.statement.fixed_robot import joint_centres

CLOSED, STEPS, REPEATS = 1e-10, 20, 3
#: Robots given joint by joint, with the motions that their platforms can make: shares of a small displacement.
ROBOTS = {
    "6-ups": (1, 1, 1, 1),
    "6-rus": (1, 1, 1, 1),
    "delta": (1, 1, 1, 0),
    "tripteron": (1, 1, 1, 0),
    "planar-3-rrr": (1, 1, 0, 1),
}
Poses = tuple[np.ndarray, np.ndarray]


def turns(axes: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Return rotations (N, 3, 3) about unit axes (N, 3)."""
    cross = np.cross(np.eye(3), axes[:, None])
    angles = angles[:, None, None]
    return np.asarray(np.eye(3) + np.sin(angles) * cross + (1 - np.cos(angles)) * (cross @ cross))


def poses_of(count: int, centre: np.ndarray, reach: np.ndarray, turn: float, axis: np.ndarray | None = None) -> Poses:
    """Return random poses; about any axis where none is given."""
    rng = np.random.default_rng(0)
    axes = rng.normal(size=(count, 3)) if axis is None else np.tile(axis, (count, 1))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    return centre + reach * rng.uniform(-1, 1, (count, 3)), turns(axes, turn * rng.uniform(-1, 1, count))


def seconds(call: Callable[[], object]) -> float:
    """Return the CPU time of a call, the best of several."""
    best = np.inf
    for _ in range(REPEATS):
        began = time.process_time()
        call()
        best = min(best, time.process_time() - began)
    return float(best)


class MujocoPlatform:
    """A Stewart platform in MuJoCo; its legs stand along x of their own frames at home."""

    name = "MuJoCo, Newton's method on 18 joints"

    def __init__(self, base: np.ndarray, platform: np.ndarray, home: np.ndarray) -> None:
        import mujoco  # noqa: PLC0415 - not everybody has it

        self.mujoco = mujoco
        legs, ties = "", ""
        inertia = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
        for k, (b, a) in enumerate(zip(base, platform, strict=True)):
            span = a + home - b
            side = np.cross(span, [1.0, 0.3, 0.2])
            texts = [" ".join(map(repr, map(float, each))) for each in (b, side, np.cross(span, side), span)]
            legs += f'<body name="u{k}" pos="{texts[0]}">{inertia}<joint type="hinge" axis="{texts[1]}"/>'
            legs += f'<body name="v{k}">{inertia}<joint type="hinge" axis="{texts[2]}"/>'
            legs += (
                f'<body name="w{k}">{inertia}<joint name="s{k}" type="slide" axis="{texts[3]}"/></body></body></body>'
            )
            ties += f'<connect body1="platform" body2="w{k}" anchor="{" ".join(map(repr, map(float, a)))}"/>'
        place = " ".join(map(repr, map(float, home)))
        self.model = mujoco.MjModel.from_xml_string(
            '<mujoco><compiler angle="radian"/>'
            '<option jacobian="dense" gravity="0 0 0"><flag contact="disable"/></option>'
            f'<worldbody><body name="platform" pos="{place}"><freejoint/>{inertia}</body>{legs}</worldbody>'
            f"<equality>{ties}</equality></mujoco>"
        )
        self.data = mujoco.MjData(self.model)
        self.slides = [self.model.joint(f"s{k}").qposadr[0] for k in range(6)]
        self.lengths = np.linalg.norm(platform + home - base, axis=1)

    def legs_at(self, poses: Poses) -> np.ndarray:
        """Return the lengths (N, 6) of the legs."""
        mujoco, model, data = self.mujoco, self.model, self.data
        mujoco.mj_resetData(model, data)
        found, quaternion = np.zeros((len(poses[0]), 6)), np.zeros(4)
        for k, (p, R) in enumerate(zip(*poses, strict=True)):
            mujoco.mju_mat2Quat(quaternion, R.ravel())
            data.qpos[:3], data.qpos[3:7] = p, quaternion
            for _ in range(STEPS):
                mujoco.mj_kinematics(model, data)
                mujoco.mj_comPos(model, data)
                mujoco.mj_makeConstraint(model, data)
                if np.abs(data.efc_pos).max() < CLOSED:
                    break
                data.qpos[7:] -= np.linalg.solve(data.efc_J.reshape(18, 24)[:, 6:], data.efc_pos)
            found[k] = self.lengths + data.qpos[self.slides]
        return found


class PinocchioPlatform:
    """A Stewart platform in pinocchio: six legs, whose ends are driven to the joints of the platform."""

    name = "pinocchio, Newton's method on 18 joints"

    def __init__(self, base: np.ndarray, platform: np.ndarray, home: np.ndarray) -> None:
        import pinocchio  # noqa: PLC0415 - not everybody has it

        self.pin, self.platform = pinocchio, platform
        self.model = pinocchio.Model()
        unaligned = (pinocchio.JointModelRevoluteUnaligned, pinocchio.JointModelPrismaticUnaligned)
        self.ends, self.slides = [], []
        spans = platform + home - base
        for k, (b, span) in enumerate(zip(base, spans, strict=True)):
            side = np.cross(span, [1.0, 0.3, 0.2])
            here, joint = pinocchio.SE3(np.eye(3), b), 0
            axes = [each / np.linalg.norm(each) for each in (side, np.cross(span, side), span)]
            for n, axis in enumerate(axes):
                kind = unaligned[n == 2](axis)
                joint = self.model.addJoint(joint, kind, here, f"{k}{n}")
                here = pinocchio.SE3.Identity()
            frame = pinocchio.Frame(f"end{k}", joint, pinocchio.SE3(np.eye(3), span), pinocchio.FrameType.OP_FRAME)
            self.ends.append(self.model.addFrame(frame))
            self.slides.append(self.model.joints[joint].idx_q)
        self.data = self.model.createData()
        self.lengths = np.linalg.norm(spans, axis=1)

    def legs_at(self, poses: Poses) -> np.ndarray:
        """Return the lengths (N, 6) of the legs."""
        pin, model, data = self.pin, self.model, self.data
        found, q, J = np.zeros((len(poses[0]), 6)), np.zeros(18), np.zeros((18, 18))
        for k, (p, R) in enumerate(zip(*poses, strict=True)):
            targets = p + self.platform @ R.T
            for _ in range(STEPS):
                pin.computeJointJacobians(model, data, q)
                pin.updateFramePlacements(model, data)
                off = np.concatenate([data.oMf[end].translation for end in self.ends]) - targets.ravel()
                if np.abs(off).max() < CLOSED:
                    break
                for i, end in enumerate(self.ends):
                    J[3 * i : 3 * i + 3] = pin.getFrameJacobian(model, data, end, pin.LOCAL_WORLD_ALIGNED)[:3]
                q -= np.linalg.solve(J, off)
            found[k] = self.lengths + q[self.slides]
        return found


def row(name: str, count: int, used: float, remark: str) -> None:
    """Print a row of the table."""
    print(f"| {name} | {count:,} | {1e6 * used / count:,.1f} | {count / used:,.0f} | {remark} |", flush=True)


def main() -> None:
    """Print the table."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    print("| robot and method | poses | us a pose | poses a second | remark |\n|---|---|---|---|---|")
    case, home = load_case("hexapod-linuxcnc"), np.array([0.0, 0.0, 20.0])
    poses = poses_of(count, home, np.full(3, 4.0), 0.3)
    found = inverse(case, *poses)
    own = seconds(lambda: inverse(case, *poses))
    row("hexapod-linuxcnc, straight legs", count, own, "lengths, J, rates")
    base, platform, _ = joint_centres(case)
    few = (poses[0][:500], poses[1][:500])
    for kind in (MujocoPlatform, PinocchioPlatform):
        try:
            other = kind(base, platform, home)
        except ImportError as error:
            print(f"| {kind.name} | - | - | - | {error} |")
            continue
        apart = np.abs(other.legs_at(few) - found.coordinates[: len(few[0])]).max()
        used = seconds(lambda other=other: other.legs_at(few))
        times = used / len(few[0]) / (own / count)
        row(kind.name, len(few[0]), used, f"lengths alone, {times:,.0f} times as long; largest difference {apart:.0e}")
    for name, shares in ROBOTS.items():
        model = build_model(name)
        dimensions = {each.name: each.typical[0] for each in model.parameters}
        at = np.array(model.home)
        robot = Case(model, dimensions, at.tolist(), [Task(np.ones(6))], Rotation())
        size = 0.1 * (float(np.linalg.norm(at)) or 1.0)
        axis = np.array([0.0, 0.0, 1.0]) if name.startswith("planar") else None
        number = min(count, 2000 if model.closure else count)
        given = poses_of(number, at, size * np.array(shares[:3]), 0.1 * shares[3], axis)
        closed = inverse(robot, *given).closed.mean()
        used = seconds(lambda robot=robot, given=given: inverse(robot, *given))
        row(name, len(given[0]), used, f"{100 * closed:.0f} % closed")


if __name__ == "__main__":
    main()
