"""Check that an FMU refuses the values that its scene refuses, with the same messages, and continues."""

from __future__ import annotations

from fmpy.fmi1 import FMICallException

import trunnion
from tests.fmu.exported_fmus import exported
from tests.fmu.fmpy_host import Host
from trunnion.basics.errors import SceneError
from trunnion.scene.overrides import apply, list_parameters

TRIALS = (-1.0, 0.0)
NAMED = "parameters."


def claim_refuses_what_the_scene_refuses(model: str) -> None:
    """Test every parameter that is a number of the scene, before the start. The FMU gives the scene's message. A refused value
    changes nothing, so that the run continues with the old value."""
    scene = trunnion.load_scene(model)
    host = Host(exported(model), begin=False)
    plain = {p.path: p.value for p in list_parameters(scene)}
    refused = 0
    for v in host.md.modelVariables:
        if v.causality != "parameter" or ".start." in v.name or not (v.name in plain or v.name.endswith(".mass")):
            continue
        for trial in TRIALS:
            host.log.clear()
            answers = said_by_the_scene(scene, v.name, trial), _said_by_the_fmu(host, v.name, trial)
            assert answers[0] == answers[1], (v.name, trial)
            refused += bool(answers[0])
            low = float(v.min) if v.min else None
            if not v.name.startswith(NAMED):  # numbers that follow from a named parameter have bounds of their own
                assert (low is not None and trial < low) == bool(answers[0]) or "must not be 0" in answers[0]
        host.put(v.name, float(v.start))
    assert refused
    host.fmu.exitInitializationMode()
    host.run(0.0, 2, 1e-3)


def said_by_the_scene(scene: trunnion.Scene, path: str, value: float) -> str:
    """The scene's first problem with the value, or with a number that follows from the value. A conflict with another value is
    reported only when the new value takes effect."""
    changes: dict[str, float | None] = {path: value}
    if path.endswith(".mass"):  # a mass that follows from a density cannot be overridden
        changes[path.removesuffix("mass") + "density"] = None
    try:
        apply(scene, changes)
    except SceneError as e:
        own = [p for p in e.problems if (p.where == path or path.startswith(NAMED)) and "(it is" in p.what]
        return f"{own[0].where}: {own[0].what}" if own else ""
    return ""


def _said_by_the_fmu(host: Host, path: str, value: float) -> str:
    """The refusal; "" if the FMU accepted the value. After a refusal, the parameter has its old value."""
    before = host.get(path)
    status = 0
    try:
        host.put(path, value)
    except FMICallException as e:
        status = e.status
    assert status in (0, 2)  # status 2 is fmi2Discard, after which the run can continue
    assert host.get(path) == (before if status else [value])
    return host.log[-1][1] if status else ""
