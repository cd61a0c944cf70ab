"""``trunnion models``."""

from __future__ import annotations

from trunnion.cli.options.option_declarations import Json
from trunnion.cli.output.exit_codes_and_errors import DONE
from trunnion.cli.output.printed_output import print_result


def command(as_json: Json = False) -> int:
    """List the bundled models with their titles."""
    from trunnion.scene.library.model_folders import bundled_names, models_dir

    found = [(name, title(name)) for name in bundled_names()]
    width = max((len(n) for n, _ in found), default=0)
    document = {"folder": str(models_dir()), "models": [{"name": n, "title": t} for n, t in found]}
    return print_result(as_json, DONE, document, [f"{name:<{width}}  {text}" for name, text in found])


def title(name: str) -> str:
    """The title of a bundled model, or the reason why the model cannot be read."""
    from trunnion.basics.errors import SceneError
    from trunnion.scene.scene_loader import load_scene

    try:
        return load_scene(name).title
    except SceneError as e:
        return f"(cannot be read: {e.problems[0]})"
