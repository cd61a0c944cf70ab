"""Units of derivatives in memory: the Jacobian unit, the linear unit and the sensitivity unit of a scene made of parts."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from engine.abi.header import number
from engine.abi.kernels import JACOBIAN, LINEAR
from engine.abi.runs import EXTRA
from engine.kernel.columns import Column
from engine.kernel.records import names_of_powers
from engine.parts import sensitive
from engine.parts.cells import Found
from engine.parts.memory import machine, scene_at
from engine.parts.rates import jacobian
from engine.parts.smooth import Smooth
from engine.parts.tape import LANES
from engine.parts.unit import Derived, Unit
from engine.system.structure import System

P = ctypes.c_void_p


def _room(s: Smooth, found: Found) -> int:
    """Doubles for a point: values, vectors, cells."""
    return s.tapes["point"].scratch + LANES * found.sizes["vectors"] + found.sizes["cells"] // 8 + 1


def jacobian_unit(system: System, active: Sequence[int], redundant: bool) -> Unit:
    """``tr_jacobian`` of a scene. active: rows of cut joints that have a multiplier."""
    s = Smooth(system)
    found = jacobian(s, active, redundant)
    numbers = {"abi": number(), "nc": s.nc, "nw": _room(s, found)}
    return Unit(JACOBIAN, Derived(s, found), numbers, {"prepare": "prepare", "eval": "j_eval"})


def linear_unit(system: System, active: Sequence[int], chosen: list[Column]) -> Unit:
    """``tr_linear`` of a scene and its columns."""
    rates, columns = sensitive.linear_rates(system, active), sensitive.linear_columns(system, chosen)
    scene = Derived(rates.scene, rates.found, Derived(columns.scene, columns.found))
    numbers = {"abi": number(), "nc": rates.scene.nc + columns.scene.nc, "ninputs": len(system.inputs)}
    return Unit(LINEAR, scene, numbers, {n: f"l_{n}" for n in ("prepare", "rates", "columns")})


class Sensitivities:
    """The functions of a sensitivity unit (``kernel.parameter_unit``): of the motion, and (outputs) of the columns."""

    def __init__(self, system: System, parameters: int, active: Sequence[int], chosen: list[Column], quadratures: bool):
        self.keep: list[Any] = []
        motion = sensitive.motion(system, parameters, active, quadratures)
        outputs = sensitive.outputs(system, parameters, chosen, quadratures)
        self.scenes = [scene_at(Derived(u.scene, u.found), self.keep) for u in (motion, outputs)]
        rates = sum(j.kind.nv for j in system.frictional)
        powers = len(names_of_powers(system)) if quadratures else 0
        self.sizes = {
            "states": sensitive.states(system), "powers": powers, "residuals": len(active) + system.neta, "rates": rates,
            "holds": len(system.sliders), "active": len(active), "extra": EXTRA.numbers + len(system.sliders),
            "constants": motion.scene.nc, "point": _room(motion.scene, motion.found), "values": motion.values,
            "o_constants": outputs.scene.nc, "o_point": _room(outputs.scene, outputs.found), "o_values": outputs.values,
        }  # fmt: skip
        self._prepare, self._point, self._along = (getattr(machine(), f"tr_parts_{n}") for n in ("prepare", "d_point", "d_along"))
        self._prepare.argtypes, self._point.argtypes = [P] * 3, [P] * 8
        self._along.argtypes = [*[P] * 7, ctypes.c_int, P, ctypes.c_size_t, P, ctypes.c_size_t]

    def prepare(self, p: int, c: int, co: int) -> None:
        """Constants from parameters."""
        for scene, out in zip(self.scenes, (c, co), strict=True):
            self._prepare(scene, p, out)

    def point(self, *places: int) -> None:
        """All values of the motion."""
        x, y, c, z, w, f = places
        self._point(x, y, c, z, None, None, w, f)

    def along(self, now: Sequence[int], seeds: np.ndarray, out: np.ndarray) -> None:
        """Their derivatives along the rows of ``seeds``, into the rows of ``out``."""
        x, y, c, z, w = now
        self._follow((x, y, c, z, None, None, w), seeds, out)

    def output_point(self, *places: int) -> None:
        """All columns."""
        self._point(*places)

    def outputs_along(self, now: Sequence[int], seeds: np.ndarray, out: np.ndarray) -> None:
        """Their derivatives."""
        self._follow(now, seeds, out)

    def _follow(self, now: Sequence[int | None], seeds: np.ndarray, out: np.ndarray) -> None:
        strides = seeds.strides[0] // seeds.itemsize, out.strides[0] // out.itemsize
        self._along(*now, len(seeds), _at(seeds), strides[0], _at(out), strides[1])


def _at(a: np.ndarray) -> int:
    """Address of an array (contiguous, writable): a march asks for hundreds of thousands, and ``a.ctypes`` takes four times as
    long."""
    return ctypes.addressof(ctypes.c_char.from_buffer(cast(Any, a))) if a.size else 0
