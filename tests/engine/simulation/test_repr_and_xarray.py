"""At a prompt, large objects are shown by one line. In xarray and pandas they are labelled data sets with units."""

from __future__ import annotations

import numpy as np
import pytest

import trunnion

MU = "joints.ball.friction.mu"


def test_sweeps_and_sensitivities_are_represented_in_a_line() -> None:
    swept = trunnion.sweep("spherical_pendulum", vary={MU: "0.1:0.6:3"}, reductions=["max:ball.qd[1]"], until=0.05)
    assert repr(swept).startswith("<Sweep of spherical_pendulum: 3 cases")
    assert "3 done" in repr(swept)
    derived = trunnion.sensitivity("spherical_pendulum", [MU], ["ball.qd[2]"], until=0.05)
    assert repr(derived) == f"<Sensitivity of ball.qd[2] to {MU}: {len(derived.time)} times>"


def test_results_and_sweeps_are_datasets_with_dimensions_and_units() -> None:
    pytest.importorskip("xarray")
    r = trunnion.simulate("spherical_pendulum", until=0.1)
    data = r.to_xarray()
    assert data.sizes == {"time": len(r)}
    assert np.array_equal(data["ball.qd[2]"].values, r["ball.qd[2]"])
    assert data["ball.qd[2]"].attrs["units"] == "rad/s"
    assert data.isel(time=slice(3))["ball.qd[2]"].attrs["units"] == "rad/s"
    frame = r.to_pandas()
    assert all(frame.attrs["units"][name] == data[name].attrs["units"] for name in frame.columns)
    assert frame.loc[:0.05, ["ball.qd[2]"]].attrs["units"]["ball.qd[2]"] == "rad/s"
    over = {MU: [0.1, 0.3, 0.6], "joints.ball.friction.radius": [0.02, 0.05]}
    swept = trunnion.sweep("spherical_pendulum", vary=over, reductions=["max:ball.qd[2]"], until=0.05)
    whole = swept.to_xarray()
    assert dict(whole.sizes) == {path: len(values) for path, values in over.items()}
    column = next(n for n in whole.data_vars if "qd[2]" in n)
    frame = swept.to_pandas()
    assert frame.attrs["units"][column] == whole[column].attrs["units"] == "rad/s"
    for _, row in frame.iterrows():
        at = {path: row[path] for path in over}
        assert float(whole[column].sel(at)) == row[column]
    cases = [{MU: 0.1}, {MU: 0.1}, {MU: 0.4}]
    listed = trunnion.sweep("spherical_pendulum", cases=cases, reductions=["max:ball.qd[2]"], until=0.05).to_xarray()
    assert dict(listed.sizes) == {"case": 3}
