"""``trunnion new``, ``models`` and ``schema``."""

from __future__ import annotations

from engine.cli.running import DONE, print_json


def new_command(name: str, folder: str, as_json: bool) -> int:
    """Write a starter scene, and say where it is and what to do next."""
    from engine.scene.starter import write_starter

    written = write_starter(name, folder)
    if as_json:
        print_json({"exit_code": DONE, "folder": str(written), "files": [str(f) for f in sorted(written.iterdir())]})
    else:
        print(f"wrote {written}: edit scene.yaml there, then\n  trunnion simulate {written} --plot {name}.png")
    return DONE


def models_command(as_json: bool) -> int:
    """Print names and titles of the bundled models."""
    from engine.scene.library import bundled_names, models_dir

    found = [(name, _title(name)) for name in bundled_names()]
    if as_json:
        print_json({"exit_code": DONE, "folder": str(models_dir()), "models": [{"name": n, "title": t} for n, t in found]})
        return DONE
    width = max((len(n) for n, _ in found), default=0)
    for name, title in found:
        print(f"{name:<{width}}  {title}")
    return DONE


def _title(name: str) -> str:
    from engine.basics.problems import SceneError
    from engine.scene.load import load_scene

    try:
        return load_scene(name).title
    except SceneError as e:
        return f"(cannot be read: {e.problems[0]})"


def schema_command() -> int:
    """Print the published JSON Schema as it is computed from the scene classes."""
    from engine.scene.schema import json_schema

    print_json(json_schema())
    return DONE
