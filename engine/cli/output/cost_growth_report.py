"""``trunnion chart --scaling``: computing time against the number of bodies, friction joints, loops and cases."""

from __future__ import annotations

from dataclasses import asdict

from trunnion.cli.output.exit_codes import DONE
from trunnion.cli.output.printed_output import print_answer, table


def measure_and_report(folder: str, repeats: int, as_json: bool) -> int:
    """Measure how computing time grows with size, write the files to a folder, print the results; returns the exit code."""
    from trunnion.analysis.work_precision.cost_growth import measure_cost_growth, write_cost_growth
    from trunnion.analysis.work_precision.machine_description import pin_to_one_core
    from trunnion.analysis.work_precision.output_files import make_folder
    from trunnion.cli.output.progress_bars import ProgressBar

    place = make_folder(folder)
    with pin_to_one_core(), ProgressBar("scaling") as bar:
        families = measure_cost_growth(repeats, progress=bar.show_part)
    lines: list[str] = []
    for f in families:
        rows = [(str(s.n), f"{1e6 * s.minimum:.3g}", f"{1e6 * s.median:.3g}", f"{s.build:.2f}") for s in f.sizes]
        lines += [f"{f.name}: {f.what}; cost ∝ n^{f.exponent:.2f}", *table(("n", "min µs", "median µs", "build s"), rows), ""]
    found = [asdict(f) | {"exponent": f.exponent} for f in families]
    return print_answer(as_json, DONE, {"families": found}, lines, [str(p) for p in write_cost_growth(families, place)])
