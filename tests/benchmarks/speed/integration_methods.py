"""Every bundled model at rtol 1e-6: stepping time of each method and of the automatic choice (goal: at most twice the time of the
best method)."""

from __future__ import annotations

from tests.benchmarks.speed.processor_time import pin, repeat
from trunnion import load_scene
from trunnion.scene.library.model_folders import model_names
from trunnion.simulation.run import Model, run
from trunnion.simulation.runtime_interface.simulation_block import Settings

METHODS = ("rk5", "rk8", "rosenbrock", "auto")


def main() -> None:
    """Print the table. The Jacobian unit is built first, so that the table compares only stepping."""
    pin()
    print(f"{'model':22s}" + "".join(f"{m:>12s}" for m in METHODS) + "   auto/best")
    for name in model_names():
        scene = load_scene(name)
        model = Model(scene, ["*.q[1]"])
        model.block.attach_jacobian()
        until = float(scene.simulation.until)
        times = {}
        for method in METHODS:
            settings = Settings(rtol=1e-6, method=method, max_steps=200_000)

            def once(settings=settings, model=model, until=until) -> float:
                result = run(model, until, until / 100, settings)
                return result.stats.wall_time if result.outcome.ok else float("inf")

            times[method] = repeat(once, 5)[0]
        best = min(times[m] for m in METHODS[:3])
        print(f"{name:22s}" + "".join(f"{times[m] * 1e3:10.3f}ms" for m in METHODS) + f"   {times['auto'] / best:.2f}")


if __name__ == "__main__":
    main()
