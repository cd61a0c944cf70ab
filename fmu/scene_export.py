"""Export of a scene as an FMU."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import Any

from trunnion.basics.errors import Problem, SceneError, SimulationError
from trunnion.fmu import zip_archive
from trunnion.fmu.binaries import platform_builds as platforms
from trunnion.fmu.binaries import python_flavour
from trunnion.fmu.c_source.model_tables import model_text
from trunnion.fmu.export_option_checks import STANDARDS, apart, check
from trunnion.fmu.model_description import terminals_and_icons
from trunnion.fmu.model_description.documentation_and_picture import licences, page
from trunnion.fmu.model_description.documentation_and_picture import picture as picture_of
from trunnion.fmu.model_description.fmi2_xml import model_description
from trunnion.fmu.model_description.fmi3_xml import model_description3
from trunnion.fmu.model_description.parameter_set_ssv import of_scene, parameter_set
from trunnion.fmu.model_description.reference_results_ls_ref import reference_files
from trunnion.fmu.reference_run import reference_run
from trunnion.fmu.variables.exported_model import ExportedModel
from trunnion.fmu.variables.fmi3_arrays import fmi3_variable_tables, fmi3_variables
from trunnion.fmu.variables.fmi3_event_clocks import clock_table, clocks
from trunnion.fmu.variables.input_sums import Sums
from trunnion.fmu.variables.model_exchange_states import KINDS, ModelExchangeVariables, does, exchanged
from trunnion.fmu.variables.output_dependencies import ColumnDependence, dependencies
from trunnion.fmu.variables.outputs_inputs_parameters import variables
from trunnion.fmu.variables.scene_parameters import arranged, begun, left_out, summed
from trunnion.kernel.compilation import c_compiler, library_cache
from trunnion.parts.kernels.scene_kernel import PartsKernel
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.overrides import Given, scene_given
from trunnion.scene.units.python_arguments import Amount, Amounts, Names
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import Model, run
from trunnion.simulation.runtime_interface.simulation_block import Settings
from trunnion.simulation.settings.realtime_steps import most_operations, promise
from trunnion.simulation.settings.run_settings import KERNELS

EVERYTHING = ("*",)
"""The value of ``outputs`` in a scene that does not select output columns."""
WHOLE = ("gravity*", "bodies.*", "forces.*")
"""Patterns of vectors. With ``whole_vectors``, all components of these vectors are parameters, including components that are 0."""
Progress = Callable[[str, int, int], None]
"""A callback. Its arguments are the text of the present work, the number of finished parts, and the number of all parts."""


@dataclass(frozen=True)
class Export:
    """An exported FMU. bytes: size of the file. variables: number of variables by causality. operations: upper bound of the
    floating-point operations of a real-time step; None if the scene has no real-time steps."""

    file: Path
    bytes: int
    guid: str
    variables: dict[str, int]
    platforms: tuple[str, ...]
    notes: tuple[str, ...]
    operations: int | None = None


def export(
    scene: Given,
    file: str | Path,
    flavour: str = "native",
    platform: Sequence[str] | str = "host",
    overrides: Mapping[str, Any] | None = None,
    outputs: Names | None = None,
    step: Amount = 0.0,
    kernel: str = KERNELS[0],
    progress: Progress | None = None,
    whole_vectors: bool = False,
    fmi: int = 2,
    parameters: str | Path | None = None,
    sources: bool = False,
    kind: str = "cs",
    certify: bool = False,
    starts: Mapping[str, float] | None = None,
    scalars: bool = False,
    reference: bool = False,
    sums: Sums | None = None,
) -> Export:
    """Write an FMU.

    scene, overrides, outputs: as in ``trunnion.simulate``. If neither the scene nor ``outputs`` selects columns, the most used
    columns become outputs. All other columns become local variables. flavour: native or python. platform: host, all, or names of
    platforms: linux64, win64, darwin64, aarch64-darwin, aarch64-linux, and with FMI 3.0 also aarch64-windows. With FMI 2.0,
    aarch64-linux excludes other platforms. The python flavour supports linux64 and win64. step: default of solver.step, s (0: error
    control). kernel: compiled (fastest steps), parts (fastest export), or auto (chosen by the structure of the scene, for long
    runs). whole_vectors: vector components that are 0 become parameters, too. Without this option, the equations omit these
    components. fmi: 2 or 3; FMI 3.0 needs the native flavour. parameters: SSV file to which the parameter values are written (FMI
    2.0 only). sources: include the C sources (native flavour only). kind: cs (co-simulation), me (model exchange, native flavour
    only), or both. certify: add the parameter ``solver.errors``. If its value is 1, each output holds the output's error estimate.
    starts: start values of the FMU's parameters by name, in SI units. Names that are not parameters are ignored. scalars: FMI 3.0
    without arrays. reference: include results of the scene with their allowed differences (FMI-LS-REF). sums: for each input that
    is a sum, its sources. Raises SceneError for wrong input, and SimulationError when the scene cannot start."""
    target, read, of = Path(file), Amounts(), kernel if sources else None
    step = read.time(step, "step")
    wrong = [*read.problems, *apart(flavour, fmi, parameters, kind, step, of, certify, scalars)]
    if reference and starts:
        wrong.append(Problem("starts", "reference results need the scene's own values", "change the scene by overrides"))
    check(flavour, kernel, kind, target, step, wrong)
    names = _platforms(flavour, platform, STANDARDS[fmi])
    loaded = scene_given(scene, overrides)
    loaded = replace(loaded, tunable=(*loaded.tunable, *(WHOLE if whole_vectors else ())))
    tell = progress or (lambda *_: None)
    tell("deriving the equations", 0, 2 + len(names))
    model, first = started(loaded, outputs, "compiled" if sources else kernel)
    brief = outputs is None and loaded.outputs == EVERYTHING
    made = ExportedScene(model, first, step, brief, STANDARDS[fmi], kind, certify, starts, scalars, sums)
    also = _related(made, outputs, step, scalars) if reference else {}
    libraries = _libraries(made, names, tell)
    tell("writing", 1 + len(names), 2 + len(names))
    zip_archive.write(target, made.documents(flavour, sources) | also | _binaries(made, flavour, libraries))
    if parameters is not None:
        Path(parameters).write_bytes(parameter_set(loaded.name, of_scene(made.listed)))
    return _written(target, made, first, tuple(names))


def _written(target: Path, made: ExportedScene, first: Result, names: tuple[str, ...]) -> Export:
    count = {c: sum(v.causality == c for _, v in made.titled()) for c in ("output", "local", "input", "parameter")}
    steps = made.model.built.scene, made.model.kernel
    notes = (*filter(None, [promise(*steps)]), *first.notes, *left_out(made.all))
    return Export(target, target.stat().st_size, made.guid, count, names, notes, most_operations(*steps))


def _related(made: ExportedScene, outputs: Names | None, step: float, scalars: bool) -> dict[str, bytes]:
    """The files of FMI-LS-REF, from a run of the whole scene with error estimates."""
    kernel = "parts" if isinstance(made.model.kernel, PartsKernel) else "compiled"
    settings = {"every": made.step, "kernel": kernel, "outputs": outputs, "step": step or None}
    run = reference_run(made.scene, made.model.built.numbers, settings)
    return reference_files(made, run, scalars or made.standard == "2.0")


def _platforms(flavour: str, platform: Sequence[str] | str, standard: str) -> list[str]:
    """The requested platforms that the flavour supports."""
    names = platforms.chosen([platform] if isinstance(platform, str) else list(platform), standard)
    made = [n for n in names if flavour == "native" or n in python_flavour.PLATFORMS]
    if not made:
        only = ", ".join(python_flavour.PLATFORMS)
        what = f"the python flavour does not support {', '.join(names)}"
        raise SceneError([Problem("--platform", what, f"{only}, or --flavour native")])
    return made


def _libraries(made: ExportedScene, names: Sequence[str], tell: Progress) -> dict[str, bytes]:
    """The compiled libraries by platform."""
    libraries: dict[str, bytes] = {}
    platforms.prepare(names, made.sources, made.standard)
    for i, name in enumerate(names):
        tell(f"compiling for {name}", 1 + i, 2 + len(names))
        libraries[name] = platforms.library(name, made.identifier, made.sources, made.standard)
    return libraries


def _binaries(made: ExportedScene, flavour: str, libraries: dict[str, bytes]) -> dict[str, bytes]:
    """The binaries, and the files that the binaries need, by path in the archive. libraries: compiled libraries by platform."""
    if flavour == "python":
        return python_flavour.contents(made.identifier, made.guid, libraries)
    folders = platforms.NAMES[made.standard]
    return {f"binaries/{folders[n]}/{made.identifier}{platforms.PLATFORMS[n].suffix}": b for n, b in libraries.items()}


def started(scene: Scene, outputs: Names | None, kernel: str) -> tuple[Model, Result]:
    """The model of a scene, and the result of a run over the first millionth of the scene's duration. Raises SimulationError when
    the scene cannot start."""
    c_compiler.needed("an FMU", "C code for its hosts")
    model = Model(scene, outputs, kernel, inf)
    sim = scene.simulation
    glimpse = 1e-6 * float(sim.until)
    settings = Settings(rtol=float(sim.rtol), method=sim.method, through_jams=sim.jams == "impact")
    result = run(model, glimpse, glimpse, settings)
    if not result.outcome.ok:
        raise SimulationError(f"the scene cannot start; nothing is exported: {result.outcome}")
    return model, result


class ExportedScene(ExportedModel):
    """The platform-independent parts of an exported model."""

    def __init__(self, model: Model, first: Result, step: float, brief: bool = False, standard: str = "2.0",
                 kind: str = "cs", certify: bool = False, starts: Mapping[str, float] | None = None,
                 scalars: bool = False, sums: Sums | None = None):  # fmt: skip
        self.model, self.first, self.standard, self.kind = model, first, standard, kind
        self.exchanged = exchanged(model) if does(kind, "me") else ModelExchangeVariables()
        self.scene = model.built.scene
        sim = self.scene.simulation
        listed = variables(model, step, float(sim.rtol), brief, does(kind, "cs"), certify)
        self.all = summed(begun(arranged(self.scene, listed), starts or {}), sums or {}, len(model.columns))
        self.bases = {s.unit: s.base for given in self.all.sums.values() for s in given if s.base}
        self.listed = self.all.listed
        self.step = float(sim.every) if sim.every is not None else float(sim.until) / 1000.0
        self.identifier = re.sub(r"\W", "_", self.scene.name, flags=re.ASCII)
        if not self.identifier[:1].isalpha():
            self.identifier = f"m_{self.identifier}"
        self.known: list[ColumnDependence] | None = None
        units = self._units()
        self.depends = dependencies(model, self.listed, self.known)
        self.fmi3_variables, self.clocks = fmi3_variables(self.listed, scalars), clocks(model)
        tables = fmi3_variable_tables(self.fmi3_variables) + clock_table(model, self.clocks) if standard == "3.0" else ""
        text = model_text(model, self.all, "", "linear" in units, tables, KINDS[kind])
        plain = self.described("", "native")
        self.guid = uuid(
            library_cache.digest(plain, text, platforms.shell_key(), *(x for pair in sorted(units.items()) for x in pair))
        )
        self.sources = {**units, "model": model_text(model, self.all, self.guid, "linear" in units, tables, KINDS[kind])}

    def described(self, guid: str, flavour: str) -> bytes:
        """``modelDescription.xml``."""
        return model_description(self, guid, flavour) if self.standard == "2.0" else model_description3(self, guid)

    def _units(self) -> dict[str, str]:
        """The C texts of the generated units, by name."""
        kernel = self.model.kernel
        if isinstance(kernel, PartsKernel):
            return self._of_parts(kernel)
        system, parameters, quadratures, redundant = kernel.structure
        made = {u: (kernel.folder / f"{u}.c").read_text() for u in ("kernel", "outputs")}
        chosen, derived = self.model.columns, bool(system.inputs) or does(self.kind, "me")
        names = ",".join(c.name for c in chosen)

        def make(folder: Path) -> None:  # imported here, because these imports take longer than an export with a filled cache
            from trunnion.kernel.c_sources import PREAMBLE, jacobian_source, linear_source
            from trunnion.kernel.units.column_dependence import dependence

            (folder / "jacobian.c").write_text(jacobian_source(system, parameters, redundant))
            linear = linear_source(system, parameters, chosen, quadratures, redundant) if derived else PREAMBLE
            (folder / "linear.c").write_text(linear)
            found = dependence(system, parameters, chosen, quadratures) if system.inputs else []
            (folder / "depends.json").write_text(json.dumps(found))

        folder, _ = library_cache.entry(f"units-2{'-linear' * derived}-{library_cache.digest(kernel.key, names)}", make)
        made["jacobian"] = (folder / "jacobian.c").read_text()
        if system.inputs:
            self.known = [ColumnDependence(*d) for d in json.loads((folder / "depends.json").read_text())]
        if derived:
            made["linear"] = (folder / "linear.c").read_text()
        return made

    def _of_parts(self, kernel: PartsKernel) -> dict[str, str]:
        """The C texts of the tables and of the parts of a parts kernel, by name."""
        from trunnion.parts.kernels.tables_as_c import parts_texts, unit_text

        kernel.jacobian()
        if self.model.system.inputs or does(self.kind, "me"):
            kernel.linear(self.model.columns)
        texts = {name: unit_text(unit, f"trunnion_{name}") for name, unit in kernel.units.items()}
        return texts | parts_texts(kernel.units.values())

    def documents(self, flavour: str, sources: bool = False) -> dict[str, bytes]:
        """The files by path in the archive: model description, picture, documentation page, licences, and C sources if
        requested."""
        picture = picture_of(self.first)
        pictures = {"model.png": picture} if self.standard == "2.0" else {
            "documentation/diagram.png": picture,
            **terminals_and_icons.files(terminals_and_icons.terminals(self.model, self.fmi3_variables), picture),
        }
        plain = {
            "modelDescription.xml": self.described(self.guid, flavour),
            **pictures,
            "documentation/index.html": page(self.first, self.titled(), flavour, self.guid, self.standard),
            **licences(flavour),
        }
        if not sources:
            return plain
        from trunnion.fmu.c_source.source_files import with_sources  # imported here, as its import takes long

        return with_sources(plain, self)


def uuid(digest: str) -> str:
    """The first 32 hexadecimal digits of a digest, grouped as a UUID."""
    return "-".join((digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32]))
