"""Rows of the gallery about rest: the effect of a dead centre on a joint at rest, and the number of releases by a periodic load."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from tests.stability.gallery_entry import Edge, Row
from tests.stability.scene_verdicts import honest, ran
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate

G = 9.81
ROUND_OFF = 1e-9
"""Round-off of a rate, relative to the joint's largest rate. A millionth of the way before or beyond the place of reversal, the
rate is a thousand times larger."""
ROD, ASIDE, SPEED = 1.0, 0.3, 1.0
"""Data of the trammel: length of the rod and start distance of the driven slider from the dead centre, m; the slider's speed,
m/s."""
MASS, MU, SWING, TURNS = 2.0, 0.3, 0.9, 5
"""Data of the ratchet: mass, kg; friction coefficient; amplitude of the load over the most that friction holds; periods of 1 s."""
RATE, START = 10.0, 0.3
"""Data of the crank: rate, rad/s; start angle, rad."""


def trammel(beyond: float) -> sm.Scene:
    """Two sliders with friction are in series along x. A rod of length L connects the second slider with a slider that is driven
    along y, at the rate v, from y = −s. The second slider is at √(L² − y²). It reverses at the dead centre y = 0, after the time
    s/v, with the acceleration −v²/L. The second slider cannot rest at the dead centre, although its speed is zero and the first
    slider rests. (μ₁ N₁ is some fifteen times the drag of the second slider on the first, μ₂ N₂.)"""
    block = sm.Body(mass=1.0, inertia=(0.05, 0.05, 0.05))
    bodies = {
        "first": block,
        "second": block,
        "rod": sm.Body(mass=0.5, inertia=(0.01, 0.05, 0.05), points={"p": (-ROD / 2, 0.0, 0.0), "q": (ROD / 2, 0.0, 0.0)}),
        "across": block,
    }
    outer, inner = (sm.Friction(mu=mu, half_width=0.02, half_height=0.02, half_length=0.5) for mu in (0.8, 0.1))
    turn = sm.AxisAngle((0.0, 0.0, 1.0), math.pi + math.asin(ASIDE / ROD))
    drive = sm.Drive(constant=sm.Constant(rate=SPEED, start=-ASIDE))
    joints = {
        "outer": sm.Joint("prismatic", "ground", "first", axis="x", pin="outboard", friction=outer, start=sm.Start(0.0, 0.0)),
        "inner": sm.Joint("prismatic", "first", "second", axis="x", pin="outboard", friction=inner,
                          start=sm.Start(math.sqrt(ROD**2 - ASIDE**2))),
        "ball": sm.Joint("spherical", "second", "rod.p", start=sm.Start(turn)),
        "pin": sm.Joint("universal", sm.Side("rod", "q", axis="z", reference="x"), sm.Side("across", axis="z", reference="x")),
        "guide": sm.Joint("prismatic", "ground", "across", axis="y", reference="z", drive=drive),
    }  # fmt: skip
    until = ASIDE / SPEED * (1 + beyond)
    return sm.Scene(bodies, joints, "trammel", gravity=(0.0, 0.0, -G), simulation=sm.Simulation(until=until), outputs=("*",))


def crank(beyond: float) -> sm.Scene:
    """A driven crank, a rod on a ball and a universal joint with friction, and a slider on a cylindrical guide with friction. The
    run ends near the dead centre at crank angle π, after (π − start)/rate. At the dead centre, the slider's rate is zero and
    prescribed by the loop, so that the slider's own friction cannot move it. The universal joint's second axis is held
    throughout."""
    steel = {"density": 7801.0}
    bodies = {
        "crank": sm.Body(box=(0.5, 0.1, 0.1), points={"i": (-0.25, 0.0, 0.0), "o": (0.25, 0.0, 0.0)}, **steel),
        "rod": sm.Body(box=(1.0, 0.1, 0.1), points={"i": (-0.5, 0.0, 0.0), "o": (0.5, 0.0, 0.0)}, **steel),
        "slider": sm.Body(box=(0.2, 0.2, 0.2), **steel),
    }
    joints = {
        "turn": sm.Joint("revolute", "ground", "crank.i", axis=(0.0, -1.0, 0.0), reference="z",
                         drive=sm.Drive(constant=sm.Constant(rate=RATE, start=START))),
        "pin": sm.Joint("spherical", "crank.o", "rod.i"),
        "cross": sm.Joint("universal", "rod.o", "slider", axis=(0.0, -1.0, 0.0), reference="z",
                          friction=sm.Friction(mu=0.2, radius=(0.02, 0.02), half_length=(0.05, 0.05))),
        "guide": sm.Joint("cylindrical", "ground", "slider", axis="x", reference="y", pin="outboard", start=sm.Start(q=(1.4, 0.0)),
                          friction=sm.Friction(mu=0.2, radius=0.03, half_length=0.15)),
    }  # fmt: skip
    until = (math.pi - START) / RATE * (1 + beyond)
    return sm.Scene(bodies, joints, "crank", gravity=(0.0, 0.0, -G), simulation=sm.Simulation(until=until), outputs=("*",))


def turned_round(scene: sm.Scene, joint: str) -> str:
    """The number of reversals of the joint up to the end, and the verdict of ``honest``. A reversal is a change of sign of the
    rate, beyond round-off. For friction of two components, round-off decides whether the run reports a reversal or a turn."""
    word, r = honest(scene), ran(scene)
    told = ("separation", "contact_jump", "reversal")
    changes = [e.kind for e in r.events if e.joint == joint and e.time > 1e-6 * r.time[-1] and e.kind not in told]
    rate = r[f"{joint}.qd[1]"]
    sign = np.sign(rate[np.abs(rate) > ROUND_OFF * np.abs(rate).max()])
    return ", ".join([word, *["turns"] * int(np.sum(sign[1:] != sign[:-1])), *changes])


def ratchet(beyond: float) -> sm.Scene:
    """A block on a rough table under a load offset + swing·sin(2π t/T), whose largest value is (1 + beyond) times the friction
    limit μ m g. With beyond > 0, the load releases the block once a period, while cos(2π τ/T) > 1 − beyond/SWING, with τ from the
    load's maximum: for 0.5 ms at one part in a million."""
    most = MU * MASS * G
    push = sm.Harmonic(amplitude=SWING * most, frequency=1.0, phase=0.0, offset=(1 + beyond - SWING) * most)
    rub = sm.Friction(mu=MU, half_width=0.01, half_height=0.01, half_length=0.5)
    slide = sm.Joint("prismatic", "ground", "block", axis="x", pin="outboard", friction=rub, effort=sm.Signal(harmonic=push))
    body = sm.Body(mass=MASS, inertia=(0.1, 0.1, 0.1))
    until = sm.Simulation(until=float(TURNS))
    return sm.Scene({"block": body}, {"slide": slide}, "ratchet", gravity=(0.0, 0.0, -G), simulation=until)


def slips(scene: sm.Scene) -> str:
    """Number of slips of the block, by every method."""
    until, counts = float(scene.simulation.until), set()
    for method in ("auto", "rk5", "rosenbrock", "moreau"):
        r = simulate(scene, until=until, every=until, rtol=1e-6, method=method)
        counts.add(sum(e.kind == "slip" for e in r.events) if r.outcome.ok else -1)
    return f"{counts.pop()} slips in {TURNS} periods" if len(counts) == 1 else f"slips by method: {sorted(counts)}"


ROWS = (
    Row(20, "trammel", "rest that a dead centre forbids", (
        Edge("run that ends at the dead centre, s/v", trammel, partial(turned_round, joint="inner"), "right", "right, turns"),),
        "a solver holds two pairs that cannot both rest, and loses kinetic energy"),
    Row(21, "ratchet", "periodic loads", (
        Edge("largest load = μ N", ratchet, slips, f"0 slips in {TURNS} periods", f"{TURNS} slips in {TURNS} periods"),),
        "steps that grow over rest pass over slips"),
    Row(22, "held_at_dead_centre", "a held pair at a dead centre", (
        Edge("run that ends at the dead centre, (π − start)/rate", crank, partial(turned_round, joint="guide"), "right",
             "right, turns"),),
        "a solver mistakes the prescribed motion for a jam"),
)  # fmt: skip
