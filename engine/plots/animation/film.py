"""A run as a film: GIF or WebP by Pillow, MP4 by PyAV (the extra ``video``)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from trunnion.basics.optional_packages import brought
from trunnion.plots.animation.film_frames import Frames
from trunnion.simulation.results.result import Result

SUFFIXES = (".gif", ".webp", ".mp4")
FPS = 15
"""Frames per second."""
SHORTEST, LONGEST = 2.0, 12.0
"""The film of a run with a duration between these limits, s, is in real time. The film of any other run takes ``USUAL`` seconds."""
USUAL = 8.0
COLORS = 128
"""Number of colours of a GIF. All frames have the same colours, because frames with different palettes would flicker."""
QUALITY = 80
SAMPLES = 6
"""Number of frames from which the palette is computed."""
Tell = Callable[[float, float], None]


def pace(result: Result) -> tuple[np.ndarray, float]:
    """(times of the frames, s; simulated time divided by the film's time)."""
    start, end = float(result.time[0]), float(result.time[-1])
    length = end - start
    seconds = length if SHORTEST <= length <= LONGEST else USUAL
    count = max(2, round(FPS * seconds))
    return np.linspace(start, end, count), (length or 1.0) / seconds


def film(result: Result, path: Path, tell: Tell | None = None) -> None:
    """Write a film in the format of the suffix. tell: function that is called with (time of the frame, last time), s, after each
    frame.

    SceneError for MP4 without PyAV, with the command that installs PyAV.
    """
    write = _mp4 if path.suffix.lower() == ".mp4" else _pillow
    write(path, _pictures(Frames(result), *pace(result), tell))


def _pictures(frames: Frames, times: np.ndarray, speed: float, tell: Tell | None) -> Iterator[np.ndarray]:
    for t in times:
        yield frames.at(float(t), speed)
        if tell is not None:
            tell(float(t), float(times[-1]))


def _pillow(path: Path, pictures: Iterator[np.ndarray]) -> None:
    from PIL import Image

    images = [Image.fromarray(p) for p in pictures]
    how: dict[str, Any] = {"save_all": True, "duration": round(1000 / FPS), "loop": 0}
    if path.suffix.lower() == ".webp":
        images[0].save(path, append_images=images[1:], quality=QUALITY, **how)
        return
    some = np.concatenate([np.asarray(i) for i in images[:: max(1, len(images) // SAMPLES)]])
    palette = Image.fromarray(some).quantize(COLORS, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    flat = [i.quantize(palette=palette, dither=Image.Dither.NONE) for i in images]
    flat[0].save(path, append_images=flat[1:], optimize=False, **how)


def _mp4(path: Path, pictures: Iterator[np.ndarray]) -> None:
    av = brought("av", "video", "--animate FILE.mp4")
    with av.open(str(path), "w") as container:
        stream = None
        for picture in pictures:
            if stream is None:
                stream = container.add_stream("h264", rate=FPS, options={"crf": "20"})
                stream.height, stream.width = picture.shape[:2]
                stream.pix_fmt = "yuv420p"
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")))
        if stream is not None:
            container.mux(stream.encode())
