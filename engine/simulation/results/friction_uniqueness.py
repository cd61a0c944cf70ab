"""The certificate of a result: uniqueness and residuals of its friction (theory, "Certificate")."""

from __future__ import annotations

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.runtime.integrators import AUTO
from trunnion.simulation.results.redundant_reactions import Redundancy
from trunnion.simulation.runtime_interface.friction_pair_and_stop_names import slider_names
from trunnion.simulation.runtime_interface.simulation_block import Block
from trunnion.system.structure.bodies_and_joints import System


@dataclass(frozen=True)
class Certificate:
    """Numbers about the uniqueness of a result (theory, "Certificate").

    Attributes:
        contraction: largest contraction factor of the fixed-point iteration of the complement equations at start, events and end;
            below 1, no other root is near.
        roots: number of roots found at start and end.
        complement: largest relative residual of the complement equations.
        indeterminate: (time, s; joint) of the first instant at which both stick and slip are solutions; None if there is none.
        redundancy: number of independent reaction patterns that the motion does not determine.
        not_unique: joints with reactions that are not unique.
        time_stepped: time, s, from which time stepping is used because events accumulate; None if events do not accumulate.
        dead_centre: time, s, of the first dead centre that a driven motion passes; None without any.
    """

    contraction: float = 0.0
    roots: tuple[int, int] = (1, 1)
    complement: float = 0.0
    indeterminate: tuple[float, str] | None = None
    redundancy: int = 0
    not_unique: tuple[str, ...] = ()
    time_stepped: float | None = None
    dead_centre: float | None = None


def certificate(block: Block, system: System, roots_at_start: int, redundancy: Redundancy) -> Certificate:
    """The certificate of a finished run."""
    c = block.certificate()
    several = (c.open_time, slider_names(system)[int(c.open_pair)][0]) if c.open_time >= 0.0 else None
    roots = (roots_at_start, block.roots() if system.neta else 1)
    return Certificate(
        c.contraction, roots, c.complement, several, redundancy.count, redundancy.joints, c.stepped if c.stepped >= 0.0 else None,
        c.dead_centre if c.dead_centre >= 0.0 else None,
    )


def certificate_notes(c: Certificate) -> list[str]:
    """Notes about the limits of a result."""
    out = []
    if c.indeterminate:
        time, joint = c.indeterminate
        out.append(
            f"indeterminate at t = {time:.6g} s, joint {joint}: sticking and slipping both satisfy the law; sticking was chosen"
        )
    if c.time_stepped is not None:
        method = AUTO.accumulating
        what = f"from this time on, {method.name} (order {method.order}) steps without locating single events"
        out.append(f"events accumulated at t = {c.time_stepped:.6g} s: {what}")
    if c.dead_centre is not None:
        out.append(
            f"dead centre at t = {c.dead_centre:.4g} s: there the drives do not determine in which direction the loop moves on; "
            "the loop kept its direction"
        )
    if max(c.roots) > 1:
        out.append(
            f"the complement equations have {max(c.roots)} roots: the root that follows continuously from zero friction was chosen"
        )
    return out
