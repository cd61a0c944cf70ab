"""The content of an exported model, from which its documents are written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from trunnion.fmu.variables.fmi3_arrays import Fmi3Variable
from trunnion.fmu.variables.fmi3_event_clocks import Clock
from trunnion.fmu.variables.model_exchange_states import ModelExchangeVariables
from trunnion.fmu.variables.output_dependencies import OutputDependencies
from trunnion.fmu.variables.outputs_inputs_parameters import Variable
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.run import Model


class ExportedModel:
    """The content of an exported model. ``trunnion.fmu.scene_export.ExportedScene`` derives the content from a scene. sources: the
    generated C texts by name. bases: by unit, the attributes of its base unit if Trunnion does not know the unit."""

    model: Model
    scene: Scene
    standard: str
    kind: str
    step: float
    identifier: str
    listed: list[Variable]
    exchanged: ModelExchangeVariables
    depends: list[OutputDependencies]
    fmi3_variables: list[Fmi3Variable]
    clocks: list[Clock]
    sources: dict[str, str]
    bases: Mapping[str, Mapping[str, str]]

    @property
    def scalars(self) -> list[Variable]:
        """The variables of FMI 2.0. The variables of model exchange come last."""
        return [*self.listed, *self.exchanged.states, *self.exchanged.rates]

    def titled(self) -> list[tuple[str, Variable]]:
        """The variables with their displayed names."""
        if self.standard == "2.0":
            return [(v.name, v) for v in self.scalars]
        whole = [replace(f.first, description=f.description) for f in self.fmi3_variables]
        ticks = [Variable(c.name, "", c.description, "output", "clock", "", None) for c in self.clocks]
        return [*((f.title, v) for f, v in zip(self.fmi3_variables, whole, strict=True)), *((c.name, c) for c in ticks),
                *((v.name, v) for v in self.exchanged.all)]  # fmt: skip
