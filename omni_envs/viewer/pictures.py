"""Pictures and videos as files."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from omni_envs.errors import InvalidOptionError, MissingDependencyError

PICTURE_SUFFIXES = (".png", ".jpg")
VIDEO_SUFFIXES = (".mp4", ".gif")


def picture_strip(pictures: Sequence[np.ndarray], columns: int | None = None) -> np.ndarray:
    """Lays pictures of equal size out in rows.

    Args:
        pictures: (H, W, 3) uint8 pictures.
        columns: Pictures in a row; all in one row by default.

    Returns:
        (rows · H, columns · W, 3) uint8 picture; missing places are white.
    """
    columns = columns or len(pictures)
    blank = np.full_like(pictures[0], 255)
    rows = []
    for start in range(0, len(pictures), columns):
        row = list(pictures[start : start + columns])
        rows.append(np.concatenate(row + [blank] * (columns - len(row)), axis=1))
    return np.concatenate(rows, axis=0)


def write_picture(path: str | Path, picture: np.ndarray, *, colours: int | None = None) -> Path:
    """Writes one picture; the suffix decides the format.

    Args:
        path: ``.png`` or ``.jpg``.
        picture: (H, W, 3) uint8.
        colours: Most colours of a ``.png``: 256 make half the file. All by default.

    Raises:
        InvalidOptionError: The suffix is not one of ``PICTURE_SUFFIXES``.
        MissingDependencyError: imageio is not installed.
    """
    path = checked_path(path, PICTURE_SUFFIXES, "picture")
    imageio = _imageio()
    if colours is None or path.suffix.lower() != ".png":
        imageio.imwrite(path, picture)
    else:
        from PIL import Image  # imageio brings it

        chosen = Image.fromarray(picture).quantize(colours, dither=Image.Dither.NONE)
        chosen.save(path, optimize=True)
    return path


def write_video(path: str | Path, pictures: Iterable[np.ndarray], fps: float) -> Path:
    """Writes a video picture by picture, so that memory stays flat; the suffix decides the format.

    Raises:
        InvalidOptionError: The suffix is not one of ``VIDEO_SUFFIXES``.
        MissingDependencyError: imageio is not installed.
    """
    path = checked_path(path, VIDEO_SUFFIXES, "video")
    if path.suffix == ".gif":
        # GIF players round delays to 1/50 s.
        options: dict[str, Any] = {"duration": 1000.0 / min(fps, 50.0), "loop": 0}
    else:
        options = {"fps": fps, "macro_block_size": 2, "quality": 7}
    with _imageio().get_writer(path, **options) as writer:
        for picture in pictures:
            writer.append_data(picture)
    return path


def checked_path(path: str | Path, suffixes: tuple[str, ...], kind: str) -> Path:
    """Returns the path of a file to write, its folder made; said before the work, not after.

    Args:
        path: The file.
        suffixes: How its name may end.
        kind: What it is, for the error.

    Raises:
        InvalidOptionError: The suffix is another.
    """
    path = Path(path)
    if path.suffix.lower() not in suffixes:
        raise InvalidOptionError(
            f"{path}: a {kind} file must end in one of {', '.join(suffixes)}; got {path.suffix!r}."
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def _imageio() -> Any:
    try:
        import imageio.v2 as imageio
    except ImportError as error:
        raise MissingDependencyError("imageio", "viewer", "Writing pictures and videos") from error
    return imageio
