"""The equations of motion of a compliant mechanism in absolute coordinates, without constraints, for many states at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.reference.compliant.compiled_rates import Compiled, library
from tests.reference.compliant.couplings import WHEELS, Rods, Screws, Wheels
from tests.reference.compliant.devices import Devices, Freedoms, Loads, listed
from tests.reference.compliant.friction_laws import BEGINS, Laws, NotJudged, bends
from tests.reference.compliant.gear_units import Loaded, Units, Worms
from tests.reference.compliant.joint_springs_and_friction import Fits, Level, is_loaded
from tests.reference.compliant.loads_by_speed_and_position import MotionLoads
from tests.reference.compliant.positions_and_rates import Forces, Frames, Motion, back, cross, times
from tests.reference.compliant.unilateral_contacts import TYPES as CONTACTS
from tests.reference.compliant.unilateral_contacts import Contacts
from tests.reference.mechanics.joint_constraints import TYPES, of

NUMBERS = ("mu", "mu_static", "preload", "torque", "back_torque", "force", "back_force", "no_load_torque")


class Model:
    """A scene as a compliant mechanism. The sides of joints are written out in the scene."""

    def __init__(self, scene, level: Level):
        self.scene, self.level = scene, level
        strange = sorted({j.type for j in scene.joints.values()} - {*TYPES, *WHEELS, *CONTACTS, "gearbox", "worm"})
        if strange:
            raise NotJudged(f"joints of type {', '.join(strange)}")
        contacts = [n for n, j in scene.joints.items() if j.type in CONTACTS and (j.unilateral is not None or j.type not in TYPES)]
        self.held = [n for n, j in scene.joints.items() if j.type in TYPES and not of(j.type).line and n not in contacts]
        wheels = [n for n, j in scene.joints.items() if j.type in WHEELS]
        screws, boxes, worms = ([n for n, j in scene.joints.items() if j.type == kind] for kind in ("screw", "gearbox", "worm"))
        self.frames = Frames(scene, len(wheels) + len(screws) + len(boxes) + len(worms))
        for name, part in self.frames.parts.items():
            moments = np.linalg.eigvalsh(part.inertia)
            if part.mass <= 0 or moments[0] <= 1e-14 * moments[-1]:  # a moment that is 0 up to round-off
                raise NotJudged(f"{name}: a body without mass or inertia")
        self.fits = Fits(replace(scene, joints={n: scene.joints[n] for n in self.held}), self.frames, level)
        self.free = Freedoms(scene, self.frames, self.held)
        self.rolling = [
            *([Wheels(scene, self.frames, level, wheels)] if wheels else []),
            *([Screws(scene, self.frames, level, screws)] if screws else []),
            *([Units(scene, self.frames, self.free, level, boxes)] if boxes else []),
            *([Worms(scene, self.frames, level, worms)] if worms else []),
        ]
        self.devices = Devices(scene, self.frames, self.free, level)
        self.rods = Rods(scene, self.frames, level, [n for n, j in scene.joints.items() if j.type == "rod"])
        self.contacts = Contacts(scene, self.frames, level, contacts)
        self.loads = Loads(self.rods.in_scene(scene), self.frames)
        self.inverse = np.linalg.inv(self.frames.inertia)
        loaded = [n for n in self.held if is_loaded(scene.joints[n].friction)]
        self.by_motion = MotionLoads(scene, self.frames, self.free, listed(scene, self.free, "nonlinear"))
        self.loaded = Loaded(scene, self.devices, self.by_motion, level, loaded) if loaded else None
        self.in_python = [x for x in self.rolling if isinstance(x, (Units, Worms))]
        self.compiled = Compiled(self) if library() is not None else None

    @property
    def laws(self) -> list[Laws]:
        """The laws of all friction pairs."""
        out = [group[3] for group in self.fits.rubbing] + (list(self.fits.given[2:]) if self.fits.given is not None else [])
        out += [self.loaded.law] if self.loaded else []
        out += [self.contacts.law] if self.contacts else []
        return out + [rows.teeth.law if isinstance(rows, Wheels) else rows.law for rows in self.rolling]

    def switches(self, t: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Functions that become negative where the state of a hook, contact or friction pair has to change: n x their number."""
        m = self.frames.motion(t, y)
        out = [self.devices.hook_functions(m)]
        if self.contacts:
            out.append(self.contacts.gaps(m))
        if self.has_jumps:
            self.rates(t, y)
            out += [np.broadcast_to(law.switches(), (len(y), len(law.jumps))) for law in self.laws]
        return np.concatenate(out, axis=1)

    def switch(self, k: int, t: float, y: np.ndarray) -> int | None:
        """Change the state that belongs to a function. Returns the number of a pair that begins to slide, else None."""
        if k < len(self.devices.latches):
            self.devices.change_hook(k, self.frames.motion(np.array([t]), y[None]))
            return None
        k, first = k - len(self.devices.latches), 0
        if k < len(self.contacts.names):
            self.contacts.switch(k, self.frames.motion(np.array([t]), y[None]))
            return None
        k -= len(self.contacts.names)
        for law in self.laws:
            if k < len(law.jumps):
                law.switch(k)
                return first + int(law.jumps[k]) if law.slides[law.jumps[k]] else None
            k, first = k - len(law.jumps), first + len(law.kinds)
        raise IndexError(k)

    @property
    def yields(self) -> bool:
        """To be read after ``rates``. True if a pair with a larger coefficient at rest moves, although its state is not yet
        sliding."""
        return any(((law.share[:, law.jumps] >= 1) & ~law.slides[law.jumps]).any() for law in self.laws)

    def moving(self, states: int) -> np.ndarray:
        """To be called after ``rates`` of this number of states. True for pairs that moved faster than their speed of rest (states
        x pairs)."""
        return np.concatenate([np.broadcast_to(law.share, (states, len(law.kinds))) for law in self.laws], axis=1) >= 1

    @property
    def has_switches(self) -> bool:
        """True if the scene has discrete states in addition to its motion."""
        return bool(self.devices.latches) or bool(self.contacts) or self.has_jumps

    @property
    def has_jumps(self) -> bool:
        """True if a pair has a larger coefficient at rest."""
        return any(len(law.jumps) for law in self.laws)

    def begin(self, y: np.ndarray) -> None:
        """Set the states of hooks and pairs at the start."""
        self.devices.start_hooks(self.free.near)
        if self.contacts:
            gap = self.contacts.relative_motion(self.frames.motion(np.zeros(1), y[None]))[0][0]
            self.contacts.inside = self.contacts.closed | (gap < 0)
        self.rates(np.zeros(1), y[None])
        for law in self.laws:
            law.slides = np.ravel(law.share >= 1)

    def rest_again(self, t: float, y: np.ndarray) -> None:
        """Set pairs to rest that slide more slowly than the speed at which a resting pair begins to slide."""
        self.rates(np.array([t]), y[None])
        for law in self.laws:
            law.slides &= np.ravel(law.share >= BEGINS)

    def kinks(self, until: float) -> list[float]:
        """The instants within a run at which a signal bends."""
        out = self.devices.kinks() + self.loads.kinks()
        for j in self.scene.joints.values():
            out += [t for key in NUMBERS if j.friction is not None for t in bends(getattr(j.friction, key))]
        return sorted({float(t) for t in out if 0 < t < until})

    def rates(self, t: np.ndarray, y: np.ndarray) -> np.ndarray:
        """The rates of states y (n x size) at times t (n or 1), computed in C if possible."""
        if not self.compiled:
            return self.defined(t, y)
        rates = self.compiled(t, y)
        if not (self.in_python or self.loaded or self.by_motion or self.contacts):
            return rates
        m = self.frames.motion(np.broadcast_to(t, (len(y),)), y)
        out, at = Forces(m), self.frames.at
        rolled = self._in_python(m, y, out)
        end = at["rolled"].stop
        rates[:, end - rolled.shape[1] : end] = rolled
        rates[:, at["v"]] += (out.force[:, :-1] / self.frames.mass[:, None]).reshape(len(y), -1)
        R = m.R[:, :-1]
        rates[:, at["w"]] += times(R, times(self.inverse, back(R, out.torque[:, :-1]))).reshape(len(y), -1)
        rates[:, at["taken"]] += out.taken
        return rates

    def _in_python(self, m: Motion, y: np.ndarray, out: Forces) -> np.ndarray:
        """Add the forces that only the Python code computes. Returns the rates of the rows of these couplings (n x rows)."""
        if self.loaded:
            self.loaded.act(m, out)
        self.by_motion.act(m, out)
        if self.contacts:
            self.contacts.act(m, out)
        at = self.frames.at["rolled"].stop - sum(len(rows.names) for rows in self.in_python)
        rates = [np.zeros((len(y), 0))]
        for rows in self.in_python:
            rates.append(rows.act(m, y[:, at : at + len(rows.names)], out))
            at += len(rows.names)
        return np.concatenate(rates, axis=1)

    def defined(self, t: np.ndarray, y: np.ndarray) -> np.ndarray:
        """The rates by their definition in this module."""
        t = np.broadcast_to(t, (len(y),))
        f, n = self.frames, self.frames.count
        m = f.motion(t, y)
        out = Forces(m)
        rolled, at = [], f.at["rolled"].start
        self.fits.act(m, out)
        for rows in self.rolling[: len(self.rolling) - len(self.in_python)]:
            count = len(rows.names)
            rolled.append(rows.act(m, y[:, at : at + count], out))
            at += count
        rolled.append(self._in_python(m, y, out))
        self.devices.act(m, out)
        self.loads.act(m, out)
        w, R = m.w[:, :n], m.R[:, :n]
        spin = times(R.swapaxes(-1, -2), w)
        torque = times(R.swapaxes(-1, -2), out.torque[:, :n]) - cross(spin, times(f.inertia, spin))
        dw = times(R, times(self.inverse, torque))
        q = y[:, f.at["q"]].reshape(len(y), n, 4)
        dq = np.empty_like(q)
        dq[..., 0] = -0.5 * (w * q[..., 1:]).sum(-1)
        dq[..., 1:] = 0.5 * (q[..., :1] * w + cross(w, q[..., 1:]))
        dv = out.force[:, :n] / f.mass[:, None]
        flat = [x.reshape(len(y), -1) for x in (m.v[:, :n], dq, dv, dw, *rolled, out.taken)]
        return np.concatenate(flat, axis=1)
