"""The result of a run, and its conversion to tables, files and HTML for notebooks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from trunnion.simulation.results.result_data import ResultData

if TYPE_CHECKING:
    import pandas
    import pyarrow
    import xarray


class Result(ResultData):
    """The result of a run, with a row for every output time.

    ``result["ball.contact[1].angle"]`` is a column (n) in the column's unit; ``result.time`` holds the times (n), s.

    Attributes:
        scene: the scene that was run.
        data: times, s, and all columns in their units (n × 1 + columns).
        columns: names, units and descriptions of the columns.
        events: the events, in order of time.
        outcome: the end of the run: name, time, joint, advice.
        stats: steps, evaluations and processor times, s.
        settings: method, tolerances and output times of the run.
        notes: remarks and warnings about the run.
        redundancy: redundant constraints, whose reactions are not unique.
        certificate: uniqueness and residuals of the friction.
        audit: violations of energy balance, constraints and friction laws along the run.
        certainty: the global error of every value, if the run was made with ``certify`` or ``accuracy``; else None.
    """

    def to_arrow(self) -> pyarrow.Table:
        """An Arrow table with units and metadata in its schema."""
        from trunnion.simulation.results.csv_and_parquet import to_arrow

        return to_arrow(self)

    def to_pandas(self) -> pandas.DataFrame:
        """A pandas frame with time as index and the units in ``frame.attrs["units"]``."""
        from trunnion.basics.optional_packages import brought

        pd = brought("pandas", "pandas", "to_pandas()")
        from trunnion.simulation.results.error_columns import with_errors

        whole = with_errors(self)
        frame = pd.DataFrame(whole.data[:, 1:], columns=whole.names[1:], index=pd.Index(self.time, name="time"))
        frame.attrs["units"] = whole.units
        return frame

    def to_xarray(self) -> xarray.Dataset:
        """An xarray dataset with the dimension ``time``. The ``attrs`` of each variable hold its unit and description; the
        dataset's ``attrs`` hold the scene's name and the outcome."""
        from trunnion.basics.optional_packages import brought
        from trunnion.simulation.results.error_columns import with_errors

        xr, all_of = brought("xarray", "xarray", "to_xarray()"), with_errors(self)
        about = [{"units": c.unit, "long_name": c.description} for c in all_of.columns]
        data = {c.name: ("time", all_of.data[:, i + 1], about[i]) for i, c in enumerate(all_of.columns)}
        whole = {"scene": self.scene.name, "outcome": str(self.outcome)}
        return xr.Dataset(data, {"time": ("time", self.time, {"units": "s"})}, whole)

    def save(self, path: str | Path) -> Path:
        """Write CSV or Parquet, depending on the suffix, with metadata: scene, settings, version, outcome, events."""
        from trunnion.simulation.results.csv_and_parquet import save

        return save(self, Path(path))

    def _repr_html_(self) -> str:
        """HTML for notebooks: outcome, events, and the main curves."""
        from trunnion.simulation.results.notebook_html import html

        return html(self)
