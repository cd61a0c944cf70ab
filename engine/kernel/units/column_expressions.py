"""Columns as expressions of the whole scene, from their definitions in ``trunnion.columns``."""

from __future__ import annotations

import casadi as ca

from trunnion.basics.interrupts import heed
from trunnion.columns.registry import REGISTRY
from trunnion.kernel.interface.output_columns import Column
from trunnion.kernel.units.column_operand_expressions import ColumnOperands
from trunnion.recursion.inward_reduction import Model
from trunnion.recursion.vector_algebra import SX


class ColumnExpressions(ColumnOperands):
    """Expressions of columns. Each kind is evaluated once for each subject."""

    def __init__(self, m: Model, quadratures: bool):
        super().__init__(m, quadratures)
        self._evaluated: dict[tuple[str, tuple], dict[str, SX]] = {}

    def value(self, column: Column) -> SX:
        """The expression of a column (1×1)."""
        heed()
        return self.output(column.kind, column.subject, column.quantity.output)[column.place]

    def output(self, kind: str, subject: tuple, name: str) -> SX:
        """An output of a kind's expression (n×1). The output of a kind that only selects a value has the name ""."""
        if (kind, subject) not in self._evaluated:
            declared = REGISTRY[kind]
            values = {n: getattr(self, o.name)(*subject[: o.subject]) for n, o in declared.operands.items()}
            found = declared.expression(**values)
            outputs = {"": found} if declared.selects else found
            self._evaluated[kind, subject] = {n: v if isinstance(v, SX) else ca.vertcat(*v) for n, v in outputs.items()}
        return self._evaluated[kind, subject][name]
