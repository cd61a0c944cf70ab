"""Programs of an output row: the selected columns, and the contact forces in which the runtime finds contact jumps."""

from __future__ import annotations

from collections.abc import Sequence

from trunnion.columns.registry import CONTACT, REGISTRY
from trunnion.kernel.interface.output_columns import Column
from trunnion.parts.bytecode.program import Program, Slot, Space
from trunnion.parts.primitives.primitive_cache import column_primitives
from trunnion.parts.primitives.primitive_keys import OUT
from trunnion.parts.programs.body_passes import ScenePasses
from trunnion.parts.programs.column_operand_slots import ColumnOperands, OperandSlots


class ColumnPrograms(ColumnOperands):
    """Slots of columns, from the definitions in ``trunnion.columns``. Each kind is evaluated once for each subject."""

    def __init__(self, scene: ScenePasses, program: Program):
        super().__init__(scene, program)
        self._evaluated: dict[tuple[str, tuple], dict[str, Slot]] = {}

    def value(self, column: Column) -> Slot:
        """The slot of a column."""
        return self.output(column.kind, column.subject, column.quantity.output).slice(column.place, 1)

    def write(self, chosen: Sequence[Column | None]) -> None:
        """Copy columns to OUT, with one call for contiguous slots."""
        first, source = 0, None
        for i, column in enumerate([*chosen, None]):
            value = self.value(column) if column else None
            if source and value and (value.space, value.at) == (source.space, source.at + source.size):
                source = Slot(source.space, source.at, source.size + 1)
                continue
            if source:
                self.program.copy(source, Slot(Space.OUT, first, source.size))
            first, source = i, value

    def watched_contacts(self, joint: str) -> Slot:
        """A ``tr_contact`` for each contact of a joint."""
        return self.output(CONTACT.name, (joint,), "watched")

    def output(self, kind: str, subject: tuple, name: str) -> Slot:
        """Slot of an output of a kind's expression. If a kind only selects a value, the output has the name ""."""
        if (kind, subject) not in self._evaluated:
            self._evaluated[kind, subject] = self._evaluate(kind, subject)
        return self._evaluated[kind, subject][name]

    def _evaluate(self, kind: str, subject: tuple) -> dict[str, Slot]:
        declared = REGISTRY[kind]
        found = {n: getattr(self, o.name)(*subject[: o.subject]) for n, o in declared.operands.items()}
        if declared.selects:
            return {"": next(iter(found.values()))}
        provided = {n: OperandSlots({"": x}) if isinstance(x, Slot) else x for n, x in found.items()}
        primitive = column_primitives.column(kind, tuple(x.structure for x in provided.values()))
        outputs = {n: self.program.scratch_slot(size) for n, size in primitive.sizes.items()}
        operands = {slot or n: at for n, x in provided.items() for slot, at in x.slots.items()}
        self.scene.call(self.program, primitive, **operands, **{OUT + n: slot for n, slot in outputs.items()})
        return outputs
