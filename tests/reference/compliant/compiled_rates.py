"""The rates of ``equations_of_motion.Model`` in C, for speed. The C code computes the same forces from the same numbers. Without a
compiler, the model uses Python."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
import tempfile
from functools import lru_cache
from pathlib import Path

import numpy as np

from tests.reference.mechanics.time_signals import drive_motion

SOURCE = Path(__file__).with_name("rates.c")
KINDS = ("", "shaft", "sleeve", "ball")


@lru_cache(1)
def library() -> tuple[ctypes.CDLL, type, tempfile.TemporaryDirectory] | None:
    """The compiled function and its structure. The names of the structure's fields are read from the C source. None without a
    compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        return None
    folder = tempfile.TemporaryDirectory()
    made = Path(folder.name) / "rates.so"
    subprocess.run([compiler, "-O2", "-fPIC", "-shared", "-o", str(made), str(SOURCE), "-lm"], check=True)
    return ctypes.CDLL(str(made)), _structures(), folder


def _fields(text: str, name: str, known: dict[str, type]) -> list[tuple[str, type]]:
    """The fields of a C structure, in order."""
    body = re.search(r"typedef struct \{([^{}]*)\} " + name + ";", text)[1]
    out: list[tuple[str, type]] = []
    for line in filter(None, (x.strip() for x in body.split(";"))):
        kind, names = re.match(r"(?:const )?(\w+) (.*)", line, re.S).groups()
        for one in re.split(r",\s*", names):
            out.append((one.strip("* "), ctypes.c_void_p if one.startswith("*") else known[kind]))
    return out


def _structures() -> type:
    text = SOURCE.with_suffix(".h").read_text()
    known: dict[str, type] = {"long": ctypes.c_long, "double": ctypes.c_double}
    for name in ("Sides", "Law", "Model"):
        known[name] = type(name, (ctypes.Structure,), {"_fields_": _fields(text, name, known)})
    return known["Model"]


class Compiled:
    """The rates of a model."""

    def __init__(self, model):
        self.model, self.keep, self.times, self.hooks = model, {}, None, None
        self.library, structure, self.folder = library()
        self.s = structure()
        self._constant()

    def _put(self, target, name: str, value, kind=float) -> None:
        """Set a field to a number or an array, and keep a reference to the array."""
        if np.isscalar(value):
            setattr(target, name, value)
            return
        array = np.ascontiguousarray(value, np.int64 if kind is int else float)
        self.keep[id(target), name] = array
        setattr(target, name, array.ctypes.data)

    def _sides(self, name: str, sides) -> None:
        target = getattr(self.s, name)
        self.keep[name] = target
        self._put(target, "n", 0 if sides is None else len(sides.one))
        if sides is not None:
            for key, value in (("one", sides.one), ("two", sides.two)):
                self._put(target, key, value, int)
            for key, value in (("x1", sides.x_one), ("F1", sides.F_one), ("x2", sides.x_two), ("F2", sides.F_two)):
                self._put(target, key, value)

    def _law(self, name: str, law) -> None:
        target = getattr(self.s, name)
        self.keep[name] = target
        self._put(target, "n", 0 if law is None else len(law.kinds))
        if law is not None:
            for key in ("eps", "fall", "drag"):
                self._put(target, key, getattr(law, key))
            self._put(target, "viscous", law.viscous, int)
            self.laws[name] = law

    def _constant(self) -> None:
        m, s, self.laws = self.model, self.s, {}
        f, at = m.frames, m.frames.at
        for key in ("q", "v", "w", "rolled"):
            setattr(s, f"at_{key}", at[key].start)
        for name, value in (("nb", f.count), ("size", f.size), ("at_taken", at["taken"]), ("delay", m.level.delay)):
            setattr(s, name, value)
        for name, value in (("mass", f.mass), ("inertia", f.inertia), ("inverse", m.inverse), ("weight", m.loads.weight)):
            self._put(s, name, value)
        self._fits()
        self._rolling()
        self._devices()

    def _fits(self) -> None:
        fits, s = self.model.fits, self.s
        n = len(fits.names)
        self._sides("fits", fits.sides)
        for key in ("held", "k", "kr", "each", "sign"):
            self._put(s, key, getattr(fits, key))
        for key in ("loose", "crossed"):
            self._put(s, key, getattr(fits, key), int)
        kind, slot, given, ends = np.zeros(n, int), np.zeros(n, int), np.full(n, -1), fits.ended.copy()
        sizes = {k: np.zeros(n) for k in ("radius", "half_length", "half_width", "half_height", "thrust_radius", "slides")}
        self.preloads, groups = [], {}
        for solve, where, size, law, end, _ in fits.rubbing:
            kind[where], slot[where], ends[where] = KINDS.index(solve.__name__), np.arange(len(where)), end
            for key in sizes:
                sizes[key][where] = size[key]
            self.preloads.append((where, size["preload"]))
            groups[solve.__name__] = law
        if fits.given is not None:
            given[fits.given[0]] = np.arange(len(fits.given[0]))
        for key, value in (("kind", kind), ("slot", slot), ("given", given)):
            self._put(s, key, value, int)
        self._put(s, "ends", ends)
        for key, value in zip(("radius", "half", "wide", "high", "thrust", "slides"), sizes.values(), strict=True):
            self._put(s, key, value)
        for name in KINDS[1:]:
            self._law(name, groups.get(name))
        for name, k in (("turn", 2), ("way", 3)):
            self._law(name, fits.given[k] if fits.given is not None else None)

    def _rolling(self) -> None:
        s = self.s
        by = {type(x).__name__: x for x in self.model.rolling}
        w, t = by.get("Wheels"), by.get("Screws")
        self._sides("wheels", w and w.sides)
        self._sides("screws", t and t.sides)
        self._law("teeth", w and w.teeth.law)
        self._law("thread", t and t.law)
        self.thread = t
        if w:
            self._put(s, "wheel_kind", [{"rack": 1, "bevel_gear": 2}.get(k, 0) for k in w.kind], int)
            for key, value in (("r1", w.r1), ("r2", w.r2), ("wheel_k", w.k), ("angle", w.teeth.angle), ("tooth_arm", w.teeth.arm)):
                self._put(s, key, value)
            self._put(s, "tooth_slot", _slots(len(w.names), w.teeth.at), int)
        if t:
            full = {k: np.zeros(len(t.names)) for k in ("radius", "helix", "flank")}
            for key in full:
                full[key][t.at] = getattr(t, key)
            for key, value in (("lead", t.lead), ("screw_k", t.k), ("screw_radius", full["radius"]), ("helix", full["helix"]),
                               ("flank", full["flank"])):  # fmt: skip
                self._put(s, key, value)
            self._put(s, "screw_slot", _slots(len(t.names), t.at), int)

    def _devices(self) -> None:
        free, d, s, loads = self.model.free, self.model.devices, self.s, self.model.loads
        n = len(free.labels)
        self._sides("free", free.sides)
        for key in ("turns", "axis", "second", "number"):
            self._put(s, key, getattr(free, key), int)
        slope, kd = np.zeros(n), np.zeros(n)
        for i, e in d.motors:
            slope[i] += e.stall / e.no_load
        for k, (i, _) in zip(d.kd, d.drives, strict=True):
            kd[i] = k
        for key, value in (("spring", d.spring), ("rest", d.rest), ("damping", d.damping), ("slope", slope), ("kd", kd)):
            self._put(s, key, value)
        self._put(s, "mimics", len(d.mimics))
        self._put(s, "mimic_at", np.array([(i, k) for i, k, _ in d.mimics], int), int)
        self._put(s, "mimic", np.array([(m.ratio, m.offset, k) for (_, _, m), k in zip(d.mimics, d.km, strict=True)]))
        self._put(s, "singles", len(loads.single))
        rows = [(i, load.type == "torque", load.frame == "body") for load, i, _, _ in loads.single]
        self._put(s, "single_at", np.array(rows, int), int)
        self._put(s, "single_x", np.array([x for _, _, x, _ in loads.single]))
        self._put(s, "springs", len(loads.springs))
        self._put(s, "spring_at", np.array([(a[0], b[0]) for _, (a, b) in loads.springs], int), int)
        self._put(s, "spring_x", np.array([np.r_[a[1], b[1]] for _, (a, b) in loads.springs]))
        self._put(s, "spring_data", np.array([(x.stiffness, x.damping, x.length) for x, _ in loads.springs]))

    def _timed(self, t: np.ndarray) -> None:
        """The quantities that depend on time, at increasing times."""
        m, s, n = self.model, self.s, len(t)
        for name, law in self.laws.items():
            target = self.keep[name]
            for key in ("mu", "rest"):
                self._put(target, key, _each(getattr(law, key)(t), n))
        preload = np.zeros((n, len(m.fits.names)))
        for where, signal in self.preloads:
            preload[:, where] = signal(t)
        self._put(s, "preload", preload)
        if m.fits.given is not None:
            for key, signal in m.fits.given[1].items():
                self._put(s, key, _each(signal(t), n))
        if self.thread:
            self._put(s, "screw_preload", _each(self.thread.preload(t), n))
        d = m.devices
        effort, wanted = np.zeros((n, len(m.free.labels))), np.zeros((2, n, len(m.free.labels)))
        for values, entries in ((d.effort(t), d.efforts), (d.signal(t), d.motors)):
            for j, (i, e) in enumerate(entries):
                effort[:, i] += values[:, j] * getattr(e, "stall", 1.0)
        if d.drives:
            for i, drive in d.drives:
                wanted[:, :, i] = np.array([drive_motion(drive, float(x))[:2] for x in t]).T
        for key, value in (("effort", effort), ("wanted", wanted[0]), ("wanted_rate", wanted[1])):
            self._put(s, key, value)
        if m.loads.single:
            self._put(s, "single_value", np.stack([_each(x(t), n) for *_, x in m.loads.single], axis=1))

    def _discrete(self, states: int) -> None:
        """The states of hooks and pairs, and the angles near which coordinates are continued."""
        d = self.model.devices
        for name, law in self.laws.items():
            target = self.keep[name]
            self._put(target, "slides", law.slides, int)
            law.share = np.zeros((states, len(law.kinds)))
            self.keep[name, "share"] = law.share
            target.share = law.share.ctypes.data
        self._put(self.s, "near", self.model.free.near)
        hooks = (tuple(d.down), tuple(d.tooth))
        if hooks == self.hooks:
            return
        self.hooks = hooks
        sides = [(i, e, x, side) for i, e in d.stops for x, side in ((e.lower, 1.0), (e.upper, -1.0))]
        stops = [(i, side, x, e.stiffness, e.damping) for i, e, x, side in sides if x is not None]
        stops += [(i, *d._hook(j), e.stiffness, e.damping) for j, (i, e) in enumerate(d.latches) if d.down[j]]
        self._put(self.s, "stops", len(stops))
        self._put(self.s, "stop_at", np.array([x[0] for x in stops], int), int)
        self._put(self.s, "stop", np.array([x[1:] for x in stops], float))

    def __call__(self, t: np.ndarray, y: np.ndarray) -> np.ndarray:
        """The rates of states at times."""
        times, row = np.unique(np.broadcast_to(t, (len(y),)), return_inverse=True)
        if not np.array_equal(times, self.times):
            self._timed(times)
            self.times = times
        self._discrete(len(y))
        self._put(self.s, "instant", row, int)
        y = np.ascontiguousarray(y)
        out = np.empty_like(y)
        pointers = (ctypes.c_void_p(y.ctypes.data), ctypes.c_void_p(out.ctypes.data))
        self.library.rates(ctypes.byref(self.s), ctypes.c_long(len(y)), *pointers)
        return out


def _each(values: np.ndarray, n: int) -> np.ndarray:
    return np.broadcast_to(values, (n, values.shape[-1]))


def _slots(n: int, at: np.ndarray) -> np.ndarray:
    out = np.full(n, -1)
    out[at] = np.arange(len(at))
    return out
