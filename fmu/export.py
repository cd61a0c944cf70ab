"""``export``: a scene in, an FMU out."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from math import inf
from pathlib import Path
from typing import Any

from engine.basics.problems import SimulationError
from engine.kernel import cache, compiler
from engine.kernel.dependence import Dependence, dependence
from engine.kernel.source import PREAMBLE, jacobian_source, linear_source
from engine.parts.kernel import PartsKernel
from engine.parts.text import parts_texts, unit_text
from engine.scene.given import Amount, Amounts, Names
from engine.scene.model import Scene
from engine.scene.overrides import Given, scene_given
from engine.simulation.block import Settings
from engine.simulation.bounded import most_operations, promise
from engine.simulation.result import Result
from engine.simulation.run import Model, run
from engine.simulation.settings import KERNELS
from fmu import archive, pages, platforms, python_flavour
from fmu.arrays import face_tables, faces
from fmu.asking import STANDARDS, apart, check
from fmu.clocks import LAST, clock_table, clocks
from fmu.dependencies import dependencies
from fmu.description import Variable, variables
from fmu.exchange import KINDS, Exchanged, does, exchanged
from fmu.following import arranged, left_out
from fmu.sources.in_fmu import with_sources
from fmu.ssv import of_scene, parameter_set
from fmu.tables import model_text
from fmu.terminals import icons, terminals
from fmu.xml import Whole, model_description
from fmu.xml3 import Described, model_description3

EVERYTHING = ("*",)
"""Outputs of a scene that says nothing of them."""
WHOLE = ("gravity*", "bodies.*", "forces.*")
"""Vectors that can be parameters with all their components, those that the scene has as 0 too."""
Progress = Callable[[str, int, int], None]
"""progress(what is being done, parts done, parts in all)."""


@dataclass(frozen=True)
class Export:
    """What was written: file, its size, GUID, variables by causality, platforms, notes about the scene's start; most
    floating-point operations of a bounded step (None: steps have no bound)."""

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
) -> Export:
    """Write an FMU.

    scene: as for ``engine.simulate``. flavour: native or python. platform: host, all, or names (linux64, win64,
    darwin64, aarch64-darwin; the python flavour has the first two). overrides, outputs: as in ``engine.simulate``; where
    neither scene nor outputs say which columns are wanted, a few are outputs, the rest local. step: default of
    solver.step, s (0: error control). kernel: compiled, which steps fastest, or parts, which is written soonest; auto chooses by
    the structure as for what is stepped for long. whole_vectors: components that the scene has as 0, which it leaves out of its
    equations, are parameters too. fmi: 2 or 3, the standard; 3 is native only. parameters: where their values are written as an SSV
    file (FMI 2.0 only). sources: the C sources go into it too (native only). kind: cs, me or both: for co-simulation, model
    exchange (native only). certify: ``solver.errors`` makes outputs their own errors. SceneError for wrong input, SimulationError
    where it cannot start.
    """
    target, read, of = Path(file), Amounts(), kernel if sources else None
    step = read.time(step, "step")
    check(flavour, kernel, kind, target, step, [*read.problems, *apart(flavour, fmi, parameters, kind, step, of, certify)])
    names = _platforms(flavour, platform, STANDARDS[fmi])
    loaded = scene_given(scene, overrides)
    loaded = replace(loaded, tunable=(*loaded.tunable, *(WHOLE if whole_vectors else ())))
    tell = progress or (lambda *_: None)
    tell("deriving the equations", 0, 2 + len(names))
    model, first = started(loaded, outputs, "compiled" if sources else kernel)
    made = Made(model, first, step, outputs is None and loaded.outputs == EVERYTHING, STANDARDS[fmi], kind, certify)
    libraries = _libraries(made, names, tell)
    tell("writing", 1 + len(names), 2 + len(names))
    archive.write(target, made.documents(flavour, sources) | _binaries(made, flavour, libraries))
    if parameters is not None:
        Path(parameters).write_bytes(parameter_set(loaded.name, of_scene(made.listed)))
    return _written(target, made, first, tuple(names))


def _written(target: Path, made: Made, first: Result, names: tuple[str, ...]) -> Export:
    """What is said of a file that has been written."""
    count = {c: sum(v.causality == c for _, v in made.titled()) for c in ("output", "local", "input", "parameter")}
    notes = (*filter(None, [promise(made.model)]), *first.notes, *left_out(made.all))
    return Export(target, target.stat().st_size, made.guid, count, names, notes, most_operations(made.model))


def _platforms(flavour: str, platform: Sequence[str] | str, standard: str) -> list[str]:
    """The platforms asked for, of those that a flavour has."""
    names = platforms.chosen([platform] if isinstance(platform, str) else list(platform), standard)
    return [n for n in names if flavour == "native" or n in python_flavour.PLATFORMS]


def _libraries(made: Made, names: Sequence[str], tell: Progress) -> dict[str, bytes]:
    """The model compiled, by platform."""
    libraries: dict[str, bytes] = {}
    platforms.prepare(names, made.sources, made.standard)
    for i, name in enumerate(names):
        tell(f"compiling for {name}", 1 + i, 2 + len(names))
        libraries[name] = platforms.library(name, made.identifier, made.sources, made.standard)
    return libraries


def _binaries(made: Made, flavour: str, libraries: dict[str, bytes]) -> dict[str, bytes]:
    """What hosts load, and what that needs, by path in the archive. libraries: the model compiled, by platform."""
    if flavour == "python":
        return python_flavour.contents(made.identifier, made.guid, libraries)
    folders = platforms.NAMES[made.standard]
    return {f"binaries/{folders[n]}/{made.identifier}{platforms.PLATFORMS[n].suffix}": b for n, b in libraries.items()}


def started(scene: Scene, outputs: Names | None, kernel: str) -> tuple[Model, Result]:
    """The model and the first millionth of its run; SimulationError when the scene cannot start."""
    compiler.needed("an FMU", "C code for its hosts")
    model = Model(scene, outputs, kernel, inf)
    sim = scene.simulation
    glimpse = 1e-6 * float(sim.until)
    settings = Settings(rtol=float(sim.rtol), method=sim.method, through_jams=sim.jams == "impact")
    result = run(model, glimpse, glimpse, settings)
    if not result.outcome.ok:
        raise SimulationError(f"the scene cannot start, so there is nothing to export: {result.outcome}")
    return model, result


class Made:
    """Everything about an exported model that does not depend on the platform."""

    def __init__(self, model: Model, first: Result, step: float, brief: bool = False, standard: str = "2.0",
                 kind: str = "cs", certify: bool = False):  # fmt: skip
        self.model, self.first, self.standard, self.kind = model, first, standard, kind
        self.exchanged = exchanged(model) if does(kind, "me") else Exchanged()
        self.scene = model.built.scene
        sim = self.scene.simulation
        self.all = arranged(self.scene, variables(model, step, float(sim.rtol), brief, does(kind, "cs"), certify))
        self.listed: list[Variable] = self.all.listed
        self.step = float(sim.every) if sim.every is not None else float(sim.until) / 1000.0
        self.identifier = re.sub(r"\W", "_", self.scene.name, flags=re.ASCII)
        if not self.identifier[:1].isalpha():
            self.identifier = f"m_{self.identifier}"
        self.known: list[Dependence] | None = None
        units = self._units()
        self.depends = dependencies(model, self.listed, self.known)
        self.faces, self.clocks = faces(self.listed), clocks(model)
        tables = face_tables(self.faces) + clock_table(model, self.clocks) if standard == "3.0" else ""
        text = model_text(model, self.all, "", "linear" in units, tables, KINDS[kind])
        plain = self.described("", "native")
        self.guid = uuid(cache.digest(plain, text, platforms.shell_key(), *(x for pair in sorted(units.items()) for x in pair)))
        self.sources = {**units, "model": model_text(model, self.all, self.guid, "linear" in units, tables, KINDS[kind])}

    def described(self, guid: str, flavour: str) -> bytes:
        """``modelDescription.xml``."""
        if self.standard == "2.0":
            whole = Whole(self.listed, self.depends, self.exchanged, self.kind)
            return model_description(self.scene, whole, self.identifier, guid, self.step, flavour)
        named = any(c.key == LAST for c in self.model.columns)
        given = Described(self.faces, self.depends, self.clocks, named, self.exchanged, self.kind)
        return model_description3(self.scene, given, self.identifier, guid, self.step)

    def _units(self) -> dict[str, str]:
        """C text of the generated units."""
        kernel = self.model.kernel
        if isinstance(kernel, PartsKernel):
            return self._of_parts(kernel)
        system, parameters, quadratures, redundant = kernel.structure
        made = {u: (kernel.folder / f"{u}.c").read_text() for u in ("kernel", "outputs")}
        chosen, derived = self.model.columns, bool(system.inputs) or does(self.kind, "me")
        names = ",".join(c.name for c in chosen)

        def make(folder: Path) -> None:
            (folder / "jacobian.c").write_text(jacobian_source(system, parameters, redundant))
            linear = linear_source(system, parameters, chosen, quadratures, redundant) if derived else PREAMBLE
            (folder / "linear.c").write_text(linear)
            found = dependence(system, parameters, chosen, quadratures) if system.inputs else []
            (folder / "depends.json").write_text(json.dumps([list(asdict(d).values()) for d in found]))

        folder, _ = cache.entry(f"units-2{'-linear' * derived}-{cache.digest(kernel.key, names)}", make)
        made["jacobian"] = (folder / "jacobian.c").read_text()
        if system.inputs:
            self.known = [Dependence(c, s, tuple(v), tuple(a)) for c, s, v, a in json.loads((folder / "depends.json").read_text())]
        if derived:
            made["linear"] = (folder / "linear.c").read_text()
        return made

    def _of_parts(self, kernel: PartsKernel) -> dict[str, str]:
        """C text of the tables of a model made of parts, and of its parts."""
        kernel.jacobian()
        if self.model.system.inputs or does(self.kind, "me"):
            kernel.linear(self.model.columns)
        texts = {name: unit_text(unit, f"trunnion_{name}") for name, unit in kernel.units.items()}
        return texts | parts_texts(kernel.units.values())

    def documents(self, flavour: str, sources: bool = False) -> dict[str, bytes]:
        """Files by path in the archive: model description, picture, documentation page, licences; sources."""
        picture = pages.picture(self.first)
        pictures = {"model.png": picture} if self.standard == "2.0" else {
            "documentation/diagram.png": picture, **icons(picture),
            "terminalsAndIcons/terminalsAndIcons.xml": terminals(self.model, self.faces),
        }  # fmt: skip
        plain = {
            "modelDescription.xml": self.described(self.guid, flavour), **pictures,
            "documentation/index.html": pages.page(self.first, self.titled(), flavour, self.guid, self.standard),
            **pages.licences(flavour),
        }
        return with_sources(plain, self) if sources else plain

    def titled(self) -> list[tuple[str, Variable]]:
        """The variables by the names that readers see."""
        if self.standard == "2.0":
            return [(v.name, v) for v in (*self.listed, *self.exchanged.states, *self.exchanged.rates)]
        whole = [replace(f.first, description=f.description) for f in self.faces]
        ticks = [Variable(c.name, "", c.description, "output", "clock", "", None) for c in self.clocks]
        return [*((f.title, v) for f, v in zip(self.faces, whole, strict=True)), *((c.name, c) for c in ticks),
                *((v.name, v) for v in self.exchanged.all)]  # fmt: skip


def uuid(digest: str) -> str:
    """The first 32 hexadecimal digits of a digest in the groups of a UUID."""
    return "-".join((digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32]))
