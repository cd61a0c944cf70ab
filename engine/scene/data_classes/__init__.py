"""The contents of a scene, as frozen dataclasses."""
