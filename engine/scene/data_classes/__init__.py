"""What a scene holds, as frozen dataclasses."""
