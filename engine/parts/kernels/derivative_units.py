"""Derivative units of a bytecode kernel, in memory: Jacobian unit, linear unit, sensitivity unit."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from trunnion.kernel.interface.output_columns import Column
from trunnion.kernel.interface.runtime_tables import names_of_powers
from trunnion.parts.bytecode.program import LANES
from trunnion.parts.derivatives import linear_and_sensitivity_units as units
from trunnion.parts.derivatives.acceleration_derivatives import DifferentiableScene
from trunnion.parts.derivatives.jacobian import jacobian
from trunnion.parts.derivatives.tangent_layout import TangentTables
from trunnion.parts.kernels.table_contents import DifferentiatedScene, UnitDescription
from trunnion.parts.kernels.tables_in_memory import interpreter, scene_at
from trunnion.runtime.abi.c_header import number
from trunnion.runtime.abi.kernel_records import JACOBIAN, LINEAR
from trunnion.runtime.abi.run_records import EXTRA
from trunnion.system.structure.bodies_and_joints import System

P = ctypes.c_void_p


def _room(s: DifferentiableScene, found: TangentTables) -> int:
    """Number of doubles in the work array of a point: values, tangents, flags of cells."""
    return s.programs["point"].scratch + LANES * found.sizes["vectors"] + found.sizes["cells"] // 8 + 1


def jacobian_unit(system: System, active: Sequence[int], redundant: bool) -> UnitDescription:
    """``tr_jacobian`` of a scene. active: rows of cut joints that have a multiplier."""
    s = DifferentiableScene(system)
    found = jacobian(s, active, redundant)
    numbers = {"abi": number(), "nc": s.nc, "nw": _room(s, found)}
    return UnitDescription(JACOBIAN, DifferentiatedScene(s, found), numbers, {"prepare": "prepare", "eval": "j_eval"})


def linear_unit(system: System, active: Sequence[int], chosen: list[Column]) -> UnitDescription:
    """``tr_linear`` of a scene and these columns."""
    rates, columns = units.linear_rates(system, active), units.linear_columns(system, chosen)
    scene = DifferentiatedScene(rates.scene, rates.tangents, DifferentiatedScene(columns.scene, columns.tangents))
    numbers = {"abi": number(), "nc": rates.scene.nc + columns.scene.nc, "ninputs": len(system.inputs)}
    return UnitDescription(LINEAR, scene, numbers, {n: f"l_{n}" for n in ("prepare", "rates", "columns")})


class Sensitivities:
    """The functions of a sensitivity unit, for the motion and for the columns (``outputs``). See
    ``parts.derivatives.linear_and_sensitivity_units``."""

    def __init__(self, system: System, parameters: int, active: Sequence[int], chosen: list[Column], quadratures: bool):
        self.keep: list[Any] = []
        motion = units.motion(system, parameters, active, quadratures)
        outputs = units.outputs(system, parameters, chosen, quadratures)
        self.scenes = [scene_at(DifferentiatedScene(u.scene, u.tangents), self.keep) for u in (motion, outputs)]
        rates = sum(j.kind.nv for j in system.frictional)
        powers = len(names_of_powers(system)) if quadratures else 0
        self.sizes = {
            "states": units.states(system), "powers": powers, "residuals": len(active) + system.neta, "rates": rates,
            "holds": len(system.sliders), "hooks": system.latches, "active": len(active),
            "extra": EXTRA.numbers + len(system.sliders),
            "constants": motion.scene.nc, "point": _room(motion.scene, motion.tangents), "values": motion.values,
            "o_constants": outputs.scene.nc, "o_point": _room(outputs.scene, outputs.tangents), "o_values": outputs.values,
        }  # fmt: skip
        self._prepare, self._point, self._along = (
            getattr(interpreter(), f"tr_parts_{n}") for n in ("prepare", "d_point", "d_along")
        )
        self._prepare.argtypes, self._point.argtypes = [P] * 3, [P] * 8
        self._along.argtypes = [*[P] * 7, ctypes.c_int, P, ctypes.c_size_t, P, ctypes.c_size_t]

    def addresses(self) -> dict[str, int | None]:
        """Addresses of the functions that ``tr_tangents`` calls."""
        point, along = (ctypes.cast(f, P).value for f in (self._point, self._along))
        return {"point": point, "along": along, "column_point": point, "column_along": along}

    def prepare(self, p: int, c: int, co: int) -> None:
        """Compute constants from parameters."""
        for scene, out in zip(self.scenes, (c, co), strict=True):
            self._prepare(scene, p, out)

    def point(self, *operands: int) -> None:
        """Compute all values of the motion at a point."""
        x, y, c, z, w, f = operands
        self._point(x, y, c, z, None, None, w, f)

    def along(self, now: Sequence[int], seeds: np.ndarray, out: np.ndarray) -> None:
        """Write derivatives of the motion along the rows of ``seeds`` into the rows of ``out``."""
        x, y, c, z, w = now
        self._follow((x, y, c, z, None, None, w), seeds, out)

    def output_point(self, *operands: int) -> None:
        """Compute all columns at a point."""
        self._point(*operands)

    def outputs_along(self, now: Sequence[int], seeds: np.ndarray, out: np.ndarray) -> None:
        """Write derivatives of the columns along the rows of ``seeds`` into the rows of ``out``."""
        self._follow(now, seeds, out)

    def _follow(self, now: Sequence[int | None], seeds: np.ndarray, out: np.ndarray) -> None:
        strides = seeds.strides[0] // seeds.itemsize, out.strides[0] // out.itemsize
        self._along(*now, len(seeds), address_of(seeds), strides[0], address_of(out), strides[1])


def address_of(a: np.ndarray) -> int:
    """Address of a contiguous, writable array. This function takes a quarter of the time of ``a.ctypes``; a run requires hundreds
    of thousands of addresses."""
    return ctypes.addressof(ctypes.c_char.from_buffer(cast(Any, a))) if a.size else 0
