"""Model exchange: directional and adjoint derivatives with respect to states and inputs equal the derivatives of the model."""

from __future__ import annotations

import atexit
import shutil
from pathlib import Path

import casadi
import numpy as np
import pytest
from fmpy import extract, read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Model

import trunnion
from tests.fmu.model_exchange.model_exchange_host import Importer, exchange, scene_of

EXACT = 1e-12
"""Allowed difference relative to the largest number of the matrix. Both results are exact; the engine's kernel is compiled for this
machine."""
SLOPE = 1e-6
"""Allowed difference relative to the largest difference of its column, by differences of fourth order over 1e-3 of the nominal
sizes."""
STEP = 1e-3
WEIGHTS = ((1, 8.0), (-1, -8.0), (2, -1.0), (-2, 1.0))
MODELS = ("spherical_pendulum", "double_pendulum", "crank_slider", "swing", "bristles")


def asked(host: Importer) -> tuple[list[int], list[int]]:
    """References of (unknowns, knowns). Unknowns are derivatives of states and continuous outputs and local variables. Knowns are
    states and inputs."""
    md = host.md
    rates = [u.variable for u in md.derivatives]
    columns = [v for v in md.modelVariables if v.causality in ("output", "local") and v.variability == "continuous"]
    columns = [v for v in columns if v.type == "Real" and not v.name.startswith(("states.", "der(", "audit."))]
    knowns = [r.derivative for r in rates] + [v for v in md.modelVariables if v.causality == "input"]
    return [v.valueReference for v in (*columns, *rates)], [v.valueReference for v in knowns]


def along(host: Importer, unknowns: list[int], knowns: list[int], seed: np.ndarray) -> np.ndarray:
    """The derivatives of unknowns along a seed of knowns."""
    return np.array(host.fmu.getDirectionalDerivative(unknowns, knowns, list(seed)))


def at(host: Importer, t: float, x: np.ndarray, u: np.ndarray, unknowns: list[int], inputs: list[int]) -> np.ndarray:
    """Values of unknowns at a time, state and inputs."""
    host.place(t, x)
    if inputs:
        host.fmu.setReal(inputs, list(u))
    return np.array(host.fmu.getReal(unknowns))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("name", MODELS)
def test_directional_derivatives_equal_differences(name: str) -> None:
    host = Importer(exchange(name))
    t = host.euler(0.0, 1e-6 if name == "bristles" else 1e-4, 300)  # the equations of bristles are stiff
    unknowns, knowns = asked(host)
    x, n = host.states(), host.md.numberOfContinuousStates
    inputs = knowns[n:]
    u = np.array(host.fmu.getReal(inputs)) if inputs else np.zeros(0)
    sizes = np.array([float(v.derivative.nominal or 1.0) for v in (d.variable for d in host.md.derivatives)] + [1.0] * len(u))
    directions = sizes * np.random.default_rng(1).standard_normal((4, len(sizes)))
    for direction in directions:
        made = along(host, unknowns, knowns, direction)
        moved = [w * at(host, t, x + STEP * k * direction[:n], u + STEP * k * direction[n:], unknowns, inputs) for k, w in WEIGHTS]
        differences = sum(moved) / (12.0 * STEP)
        at(host, t, x, u, unknowns, inputs)
        off = np.abs(made - differences) / np.maximum(np.abs(differences).max(), 1.0)
        assert off.max() <= SLOPE, [host.md.modelVariables[unknowns[i]].name for i in np.argsort(off)[-4:]]


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("name", MODELS)
def test_directional_derivatives_equal_the_engines_matrices(name: str) -> None:
    """The matrices at the start are the derivatives of states with respect to states and inputs."""
    host, linear = Importer(exchange(name)), trunnion.linearize(scene_of(name))
    n, ny = host.md.numberOfContinuousStates, len(linear.x)
    unknowns, knowns = asked(host)
    rates = unknowns[-n:][:ny]
    assert host.states()[:ny] == pytest.approx(linear.x, abs=1e-12)
    made = np.array([along(host, rates, [k], np.ones(1)) for k in [*knowns[:ny], *knowns[n:]]]).T
    exact = np.hstack([linear.A, linear.B])
    assert np.abs(made - exact).max() <= EXACT * np.abs(exact).max()


@pytest.mark.parametrize("fmi", [2, 3])
def test_casadi_evaluates_the_model_at_any_state_and_gets_the_engines_matrices(fmi: int, tmp_path: Path) -> None:
    """CasADi sets states as variables in continuous-time mode. It reads dependencies only if the description lists them."""
    linear = trunnion.linearize(scene_of("swing"))
    model = casadi.DaeBuilder("m", str(extract(exchange("swing", fmi), unzipdir=str(tmp_path))))
    ode = model.create("f", ["x", "u"], ["ode"])
    matrices = ode.factory("J", ["x", "u"], ["jac:ode:x", "jac:ode:u"])
    n, u = len(linear.x), [9.0]
    rest = np.zeros(ode.size1_in(0) - n)
    for shift in (0.3, 0.0):
        rates = np.array(ode(np.append(linear.x + shift, rest), u)).ravel()
        assert rates[: n // 2] == pytest.approx(linear.x[n // 2 :] + shift, abs=1e-15)  # the rates q̇ are themselves states
    A, B = (np.array(x)[:n] for x in matrices(np.append(linear.x, rest), u))
    assert np.abs(A[:, :n] - linear.A).max() <= EXACT * np.abs(linear.A).max()
    assert np.abs(B - linear.B).max() <= EXACT * np.abs(linear.B).max()


def test_adjoint_derivatives_are_the_transposed_directional_ones() -> None:
    """The test uses FMI 3.0 in event mode. Indicators have no derivatives, and the FMU reports this."""
    file = exchange("swing", 3)
    md, folder, log = read_model_description(file), extract(file), []
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    fmu = FMU3Model(guid=md.guid, unzipDirectory=folder, instanceName="i", modelIdentifier=md.modelExchange.modelIdentifier)
    fmu.instantiate(logMessage=lambda *said: log.append(said[-1].decode()))
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    rates, told = ([u.variable for u in found] for found in (md.derivatives, md.eventIndicators))
    unknowns = [v.valueReference for v in rates] + [v.valueReference for v in md.modelVariables if v.name == "knee.reaction.force"]
    knowns = [v.derivative.valueReference for v in rates] + [v.valueReference for v in md.modelVariables if v.name == "motor"]
    numbers = len(rates) + 3
    J = np.array([fmu.getDirectionalDerivative(unknowns, [k], [1.0], numbers) for k in knowns]).T
    assert np.abs(J[len(rates) :]).max() > 0.0  # some reactions depend on knowns
    for row in np.random.default_rng(2).standard_normal((3, numbers)):
        made = np.array(fmu.getAdjointDerivative(unknowns, knowns, list(row), len(knowns)))
        assert np.abs(made - row @ J).max() <= EXACT * np.abs(J).max()
    with pytest.raises(FMICallException):
        fmu.getDirectionalDerivative([told[0].valueReference], knowns[:1], [1.0], 1)
    assert log[-1].endswith("an unknown of a derivative must be an output or a derivative of a state")
