"""A commented scene to fill in."""

from pathlib import Path

from frictionlab.errors import UsageError
from frictionlab.files import make_folder, write_whole
from frictionlab.scene import SCENE_NAME
from frictionlab.scene.text import template
from frictionlab.verbs.inputs import FilePath


def init(folder: FilePath = ".", *, force: bool = False) -> Path:
    """Write a commented scene, ``frictionlab.toml``, into a folder and return its path.

    Parameters
    ----------
    folder : str or Path
        Made if it is not there.
    force : bool
        Replace a file of that name.

    Raises
    ------
    UsageError
        One stands there already.
    OutputError
        It cannot be written.
    """
    path = Path(folder) / SCENE_NAME
    if path.exists() and not force:
        raise UsageError(f"{path}: exists: fill it in, or give --force to replace it")
    make_folder(path.parent)
    write_whole(path, template().encode())
    return path
