"""A table of cases as an xarray dataset, with the dimensions of its grid or with the dimension ``case``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.basics.optional_packages import brought

if TYPE_CHECKING:
    import pyarrow
    import xarray


def units(table: pyarrow.Table) -> dict[str, str]:
    """The unit of each column."""
    return {f.name: (f.metadata or {}).get(b"unit", b"").decode() for f in table.schema}


def dataset(table: pyarrow.Table, paths: Sequence[str], count: int, about: Mapping[str, Any]) -> xarray.Dataset:
    """The table as a dataset. If its ``count`` cases are a grid whose last path varies fastest, every path is a dimension.
    Otherwise the only dimension is ``case``.

    ``attrs`` hold units and ``about``. Missing cases of a grid are NaN.
    """
    xr = brought("xarray", "xarray", "to_xarray()")
    said, cases = units(table), table["case"].to_numpy()
    axes = {path: list(dict.fromkeys(table[path].to_numpy().tolist())) for path in paths}
    sizes = [len(a) for a in axes.values()]
    if not axes or prod(sizes) != count:
        data = {n: ("case", table[n].to_pandas().to_numpy(), {"units": u}) for n, u in said.items() if n != "case"}
        return xr.Dataset(data, {"case": cases}, dict(about))
    found = {}
    for name, unit in said.items():
        if name != "case" and name not in axes:
            found[name] = (list(axes), _spread(table[name], cases, sizes), {"units": unit})
    return xr.Dataset(found, {p: (p, a, {"units": said[p]}) for p, a in axes.items()}, dict(about))


def _spread(column: Any, cases: Any, sizes: list[int]) -> np.ndarray:
    """A column, arranged on the grid. The last path varies fastest."""
    values = column.to_pandas().to_numpy()
    plain = values.dtype.kind in "fiu"
    whole = np.full(prod(sizes), np.nan if plain else None, float if plain else object)
    whole[cases] = values
    return whole.reshape(sizes)
