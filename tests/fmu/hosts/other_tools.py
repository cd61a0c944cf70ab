"""Other tools that simulate FMUs. ``python other_tools.py TOOL STOP STEP FILE …`` runs in an environment with that tool, without
Trunnion. Each FILE is an FMU or an SSP file. For each FILE, the script prints one line: the final values of the outputs as JSON, or
the last line of the tool's exception."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import traceback
import zipfile
from pathlib import Path
from typing import Any

Values = dict[str, float]
MARK = "values: "
"""The beginning of a line with values; tools print lines, too."""
PROCESSOR_SECONDS = 60
"""Processor time of a file, s. A signal ends a process that needs more."""


def outputs(file: str) -> list[Any]:
    """The scalar outputs of an FMU that are real numbers."""
    from fmpy import read_model_description

    told = read_model_description(file, validate=False).modelVariables
    return [v for v in told if v.causality == "output" and v.type in ("Real", "Float64") and not getattr(v, "dimensions", None)]


def fmpy(file: str, stop: float, step: float) -> Values:
    from fmpy import read_model_description, simulate_fmu
    from fmpy.ssp.simulation import simulate_ssp

    if file.endswith(".ssp"):
        got = simulate_ssp(file, stop_time=stop - step / 2, step_size=step)
        return {n: float(got[n][-1]) for n in got.dtype.names if n != "time"}
    names = [v.name for v in outputs(file)]
    exchange = read_model_description(file, validate=False).coSimulation is None
    how = {"fmi_type": "ModelExchange", "relative_tolerance": 1e-9} if exchange else {"fmi_type": "CoSimulation"}
    got = simulate_fmu(file, stop_time=stop, output_interval=step, output=names, **how)
    return {n: float(got[n][-1]) for n in names}


def fmpy_compiled(file: str, stop: float, step: float) -> Values:
    """fmpy with binaries that fmpy compiles from the sources of the FMU."""
    from fmpy import extract
    from fmpy.build import build_platform_binary

    folder = Path(extract(file))
    shutil.rmtree(folder / "binaries")
    build_platform_binary(folder)
    return fmpy(str(folder), stop, step)


def libcosim(file: str, stop: float, step: float) -> Values:
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    run, seen = CosimExecution.from_step_size(round(step * 1e9)), CosimObserver.create_last_value()
    one = run.add_local_slave(CosimLocalSlave(fmu_path=file, instance_name="one"))
    run.add_observer(seen)
    run.step(round(stop / step))
    named = {v.name.decode(): v.reference for v in run.slave_variables(one)}
    return {v.name: seen.last_real_values(one, [named[v.name]])[0] for v in outputs(file)}


def ecos(file: str, stop: float, step: float) -> Values:
    from ecospy import EcosSimulation, EcosSimulationStructure

    if file.endswith(".ssp"):
        from fmpy.ssp.ssd import read_ssd

        names = [f"{c.name}::{p.name}" for c in read_ssd(file).system.elements for p in c.connectors if p.kind == "output"]
        made: dict[str, Any] = {"ssp_path": file}
    else:
        structure = EcosSimulationStructure()
        structure.add_model("one", file)
        made, names = {"structure": structure}, [f"one::{v.name}" for v in outputs(file)]
    with EcosSimulation(step_size=step, **made) as run:
        run.init()
        for _ in range(round(stop / step)):
            run.step()
        values = {n: run.get_real(n) for n in names}
    return {n.replace("::", ".") if file.endswith(".ssp") else n.partition("::")[2]: x for n, x in values.items()}


def cofmupy(file: str, stop: float, step: float) -> Values:
    from cofmupy import Coordinator

    config = Path(tempfile.mkdtemp()) / "config.json"
    fmus = [{"id": "one", "path": file, "name": "one"}]
    config.write_text(json.dumps({"fmus": fmus, "connections": [], "cosim_method": "jacobi"}))
    run = Coordinator()
    run.start(str(config))
    for _ in range(round(stop / step)):
        run.do_step(step_size=step)
    got = run.get_results()
    return {v.name: float(got["one", v.name][-1]) for v in outputs(file)}


def container(file: str, stop: float, step: float) -> Values:
    """The container of fmu_manipulation_toolbox, run by fmpy. The container exposes outputs of an SSP file only if its JSON file
    lists them."""
    folder, name = Path(tempfile.mkdtemp()), Path(file).name
    shutil.copyfile(file, folder / name)
    if file.endswith(".ssp"):
        _fmucontainer(folder, f"{name}:{step}", "-dump-json")
        made = json.loads((folder / f"{Path(name).stem}-dump.json").read_text()) | {"auto_output": True}
    else:
        made = {"fmu": [name], "step_size": step, "auto_output": False, "output": [[name, v.name, v.name] for v in outputs(file)]}
    (folder / "made.json").write_text(json.dumps(made | {"name": "made.fmu"}))
    _fmucontainer(folder, "made.json", "-fmi", "3" if Path(name).stem.endswith("3") else "2")
    return fmpy(str(folder / "made.fmu"), stop, step)


def _fmucontainer(folder: Path, given: str, *more: str) -> None:
    words = ["-fmu-directory", str(folder), "-container", given, *more]
    told = subprocess.run([str(Path(sys.executable).parent / "fmucontainer"), *words], capture_output=True, text=True, check=False)
    if "is available" not in told.stdout + told.stderr:
        raise RuntimeError((told.stdout + told.stderr)[-600:])


def casadi(file: str, stop: float, step: float) -> Values:
    """Difference between the state derivatives at the start in this tool and in fmpy. CasADi's DaeBuilder supports neither events
    nor co-simulation."""
    import casadi as ca
    from fmpy import simulate_fmu

    folder = tempfile.mkdtemp()
    zipfile.ZipFile(file).extractall(folder)
    dae = ca.DaeBuilder("one", folder)
    f = dae.create("f", ["x"], ["ode"])
    names = dae.x()
    wanted = [*names, *(f"der({n})" for n in names)]
    got = simulate_fmu(file, stop_time=step, output_interval=step, output=wanted, fmi_type="ModelExchange")[0]
    rates = f([float(got[n]) for n in names])
    pairs = zip(names, rates.full().ravel(), strict=True)
    return {"difference": max(abs(float(r) - got[f"der({n})"]) / max(1.0, abs(float(r))) for n, r in pairs)}


def fmuloader(file: str, stop: float, step: float) -> Values:
    from fmpy import read_model_description
    from fmuloader.fmi2 import Fmi2Slave, Fmi2Type
    from fmuloader.fmi3 import Fmi3Slave

    told = read_model_description(file, validate=False)
    identifier, refs = told.coSimulation.modelIdentifier, [v.valueReference for v in outputs(file)]
    if told.fmiVersion.startswith("3"):
        one: Any = Fmi3Slave(file, model_identifier=identifier)
        one.instantiate_co_simulation("one", instantiation_token=told.instantiationToken)
        one.enter_initialization_mode(0.0, stop)
    else:
        one = Fmi2Slave(file, model_identifier=identifier)
        one.instantiate("one", Fmi2Type.CO_SIMULATION, guid=told.guid)
        one.setup_experiment(0.0, stop)
        one.enter_initialization_mode()
    one.exit_initialization_mode()
    for k in range(round(stop / step)):
        one.do_step(k * step, step)
    get = one.get_float64 if told.fmiVersion.startswith("3") else one.get_real
    return dict(zip([v.name for v in outputs(file)], get(refs), strict=True))


def pathsim(file: str, stop: float, step: float) -> Values:
    from fmpy import read_model_description
    from pathsim import Connection, Simulation
    from pathsim.blocks import Scope
    from pathsim_fmi import CoSimulationFMU, ModelExchangeFMU

    exchange = read_model_description(file, validate=False).coSimulation is None
    one = ModelExchangeFMU(file) if exchange else CoSimulationFMU(file, dt=step)
    names = [v.name for v in outputs(file)]
    scope = Scope(labels=names)
    links = [Connection(one[n], scope[i]) for i, n in enumerate(names)]
    Simulation([one, scope], links, dt=step, log=False).run(stop)
    _, rows = scope.read()
    return {n: float(row[-1]) for n, row in zip(names, rows, strict=True)}


def pyfmi(file: str, stop: float, step: float) -> Values:
    """PyFMI, which reads FMUs by FMI Library instead of fmpy."""
    from pyfmi import load_fmu

    os.chdir(tempfile.mkdtemp())
    model = load_fmu(file, log_level=0)
    options = model.simulate_options()
    options["ncp"] = round(stop / step)
    if "CVode_options" in options:
        options["CVode_options"].update({"rtol": 1e-9, "verbosity": 50})
    got = model.simulate(final_time=stop, options=options)
    return {v.name: float(got[v.name][-1]) for v in outputs(file)}


def sofirpy(file: str, stop: float, step: float) -> Values:
    from sofirpy import simulate

    names = [v.name for v in outputs(file)]
    got = simulate(stop, step, fmu_paths={"one": Path(file)}, parameters_to_log={"one": names})
    return {n: float(got[f"one.{n}"].iloc[-1]) for n in names}


def syssimx(file: str, stop: float, step: float) -> Values:
    from syssimx import System
    from syssimx.components.fmu import FMUComponent

    system, one = System("system"), FMUComponent("one", file)
    system.add_component(one)
    system.initialize(0.0)
    system.run(0.0, stop, step)
    got = one.get_outputs()
    return {v.name: float(getattr(got[v.name], "magnitude", got[v.name])) for v in outputs(file)}


def pycosim(file: str, stop: float, step: float) -> Values:
    from PyCosimLibrary.jacobi_runner import JacobiRunner
    from PyCosimLibrary.loader import FMULoader
    from PyCosimLibrary.scenario import CosimScenario, OutputConnection, SignalType, VarType

    one = FMULoader.load(file, "one", None).fmu
    one.instantiate()
    refs = [v.valueReference for v in outputs(file)]
    seen = OutputConnection(value_type=VarType.REAL, signal_type=SignalType.CONTINUOUS, source_fmu=one, source_vr=refs)
    run = CosimScenario(fmus=[one], connections=[], outputs=[seen], step_size=step, stop_time=stop, print_interval=step)
    got = JacobiRunner().run_cosim(run, None).out_signals["one"]
    return {v.name: float(got[v.valueReference][-1]) for v in outputs(file)}


def energysim(file: str, stop: float, step: float) -> Values:
    """energysim records values at the beginning of each step."""
    from energysim import world

    os.chdir(tempfile.mkdtemp())
    names = [v.name for v in outputs(file)]
    run = world(start_time=0, stop_time=stop + step, t_macro=stop + step)
    run.add_simulator(sim_type="fmu", sim_name="one", sim_loc=file, outputs=names, step_size=step)
    run.add_connections({})
    run.simulate(pbar=False)
    got = run.results()["one"]
    last = (got["time"] - stop).abs().argmin()
    return {n: float(got[n].iloc[last]) for n in names}


def bd2cmake(file: str, stop: float, step: float) -> Values:
    """fmpy with binaries built by the CMakeLists.txt that fmi-bd2cmake writes for the sources of an FMU."""
    from fmpy import __file__ as place
    from fmpy import extract, sharedLibraryExtension

    folder, programs = Path(extract(file)), Path(sys.executable).parent
    library = next((folder / "binaries").rglob(f"*{sharedLibraryExtension}"))
    library.unlink()
    headers = Path(place).parent / "c-code"
    for words in (["fmi-bd2cmake"], ["cmake", "-B", "made", f"-DFMI_HEADERS_DIR={headers}", "."], ["cmake", "--build", "made"]):
        subprocess.run([programs / words[0], *words[1:]], cwd=folder, capture_output=True, text=True, check=True)
    shutil.copyfile(next((folder / "made").rglob(f"*{sharedLibraryExtension}")), library)
    return fmpy(str(folder), stop, step)


if __name__ == "__main__":
    tool, stop, step, *files = sys.argv[1:]
    for file in files:
        signal.setitimer(signal.ITIMER_PROF, PROCESSOR_SECONDS)
        try:
            found = globals()[tool](file, float(stop), float(step))
        except Exception as e:  # noqa: BLE001 any exception of a tool is its refusal
            found = traceback.format_exception_only(e)[-1].splitlines()[-1]
        print("\n" + MARK + json.dumps(found), flush=True)
    os._exit(0)
