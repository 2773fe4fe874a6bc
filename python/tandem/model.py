"""A robot's dynamics on its generated kernels."""

from __future__ import annotations

import os
from typing import Any, List, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from .fields import Sealed

Array = NDArray[np.float64]


class Model(Sealed):
    """The dynamics of the robot of a robot.toml. Immutable; any thread.

    Each argument is a vector of one state, or a 2-D array with a state in each row: (N, nq) for q,
    (N, nv) for v, vdot and tau. A vector beside 2-D arrays serves all rows. Results have a row a
    state then. A floating base's q begins with its position [m] in W and its quaternion (x y z w),
    its v with its linear and angular velocity in its own frame (docs/conventions.md).

    wrench: (6 * len(wrenches)) force [N], then moment [Nm], at each site of `wrenches`, in the
    site's frame, on the robot; None: none.

    Errors: tandem.Error, what the files or kernels have; FileNotFoundError; ValueError names the
    argument of another shape, or that is not finite.
    """

    robot: str  #: its name
    joints: List[str]  #: in the order of v, behind the base's six
    sites: List[str]  #: frames with pose and Jacobian
    wrenches: List[str]  #: sites where a wrench may act
    nq: int  #: elements of q
    nv: int  #: elements of v
    floating_base: bool
    mass_kg: float  #: of everything that moves
    variant: str  #: of the kernels: "x86-64-v3"

    def __init__(
        self,
        robot: Union[str, "os.PathLike[str]"],
        *,
        derivatives: bool = False,
        build: bool = True,
        variant: str = "",
    ) -> None:
        """Reads the robot (robot.toml, or a bundled one's name as "panda") and finds its kernels.

        build: makes those that are missing, once.
        derivatives: as if robot.toml had `derivatives = true` in [model].
        """
        kernels = _native.Kernels(os.fspath(robot), derivatives, build, variant)
        self._kernels = kernels
        self.robot, self.joints, self.sites = kernels.robot, kernels.joints, kernels.sites
        self.wrenches, self.nq, self.nv = kernels.wrenches, kernels.nq, kernels.nv
        self.floating_base, self.mass_kg = kernels.floating_base, kernels.mass_kg
        self.variant = kernels.variant
        self._seal()

    def forward_dynamics(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike, wrench: Optional[ArrayLike] = None
    ) -> Array:
        """Accelerations vdot (nv) [rad/s2 or m/s2] under the torques tau (nv) [Nm or N]."""
        return self._kernels.forward_dynamics(q, v, tau, wrench)

    def inverse_dynamics(
        self, q: ArrayLike, v: ArrayLike, vdot: ArrayLike, wrench: Optional[ArrayLike] = None
    ) -> Array:
        """Torques tau (nv) [Nm or N] for the accelerations vdot (nv): M vdot + h - J^T wrench."""
        return self._kernels.inverse_dynamics(q, v, vdot, wrench)

    def mass_matrix(self, q: ArrayLike) -> Array:
        """M (nv, nv), symmetric, with the motors' armature on its diagonal."""
        return self._kernels.mass_matrix(q)

    def bias(self, q: ArrayLike, v: ArrayLike) -> Array:
        """h (nv) [Nm or N]: Coriolis, centrifugal and gravity."""
        return self._kernels.bias(q, v)

    def energy(self, q: ArrayLike, v: ArrayLike) -> Array:
        """Kinetic and potential energy (2) [J]; the potential is zero at W's origin."""
        return self._kernels.energy(q, v)

    def center_of_mass(self, q: ArrayLike, v: ArrayLike) -> Tuple[Array, Array, Array]:
        """Its position (3) [m] and velocity (3) [m/s] in W, and its Jacobian (3, nv)."""
        return self._kernels.center_of_mass(q, v)

    def forward_dynamics_derivatives(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike, wrench: Optional[ArrayLike] = None
    ) -> Tuple[Array, Array, Array]:
        """Of vdot by q, v and tau, (nv, nv) each: row i has those of element i.

        A floating base's columns by q are a displacement in its own frame, in the order of v.
        """
        return self._kernels.forward_dynamics_derivatives(q, v, tau, wrench)

    def inverse_dynamics_derivatives(
        self, q: ArrayLike, v: ArrayLike, vdot: ArrayLike, wrench: Optional[ArrayLike] = None
    ) -> Tuple[Array, Array, Array]:
        """Of tau by q, v and vdot, (nv, nv) each, as forward_dynamics_derivatives()."""
        return self._kernels.inverse_dynamics_derivatives(q, v, vdot, wrench)

    def site_pose(self, site: str, q: ArrayLike) -> Array:
        """(4, 4): the site's frame in W, rotation and origin [m]."""
        poses, _ = self._kernels.site_twists(q, np.zeros(self.nv))
        pose = poses[..., self._site(site), :]
        out = np.zeros(pose.shape[:-1] + (4, 4))
        out[..., :3, :3] = pose[..., :9].reshape(pose.shape[:-1] + (3, 3))
        out[..., :3, 3] = pose[..., 9:]
        out[..., 3, 3] = 1.0
        return out

    def site_twist(self, site: str, q: ArrayLike, v: ArrayLike) -> Array:
        """(6): velocity of the site's origin [m/s], then angular velocity [rad/s], in W."""
        return self._kernels.site_twists(q, v)[1][..., self._site(site), :]

    def site_jacobian(self, site: str, q: ArrayLike) -> Array:
        """(6, nv): twist = J v, as site_twist()."""
        return self._kernels.site_jacobians(q)[..., self._site(site), :, :]

    def indices(self, joints: Sequence[str]) -> NDArray[np.intp]:
        """Where these joints are in v and tau; in q, one further behind a floating base.

        A run's images have the order of robot.toml: `tau[model.indices(run.joints)]`.
        """
        base = 6 if self.floating_base else 0
        for name in joints:
            if name not in self.joints:
                _native.unknown("joint", str(name), self.joints)
        return np.array([base + self.joints.index(name) for name in joints], dtype=np.intp)

    def _site(self, name: str) -> int:
        if name not in self.sites:
            _native.unknown("site", str(name), self.sites)
        return self.sites.index(name)

    def __repr__(self) -> str:
        return f"<Model of {self.robot}: nq {self.nq}, nv {self.nv}, {self.mass_kg:.3f} kg>"
