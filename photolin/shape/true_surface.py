"""What is known of a surface that a result is measured against."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..load.lights import read_table
from ..synthetic import Truth
from .directions import normalize

BENCHMARK = "Normal_gt.mat"
DIRECTIONS = "light_directions.txt"
OBJECTS = "objid"
"""Optional array of gt.npz, (H,W): number of the object that a pixel shows, from 1."""


@dataclass(frozen=True, eq=False)
class TrueSurface:
    """Normals, and what else is known; x right, y up, z to the camera; read-only."""

    normals: NDArray[np.float64]
    """(H,W,3) unit; 0 outside the mask."""
    mask: NDArray[np.bool_]
    """(H,W)"""
    depth: NDArray[np.float64] | None = None
    """(H,W) z in mm; NaN outside the mask."""
    px_mm: float | None = None
    """Side of a pixel, mm; known where depth is."""
    lights: NDArray[np.float64] | None = None
    """(K,3) towards the light, of any length."""
    thing: NDArray[np.bool_] | None = None
    """(H,W) the object that shapes are compared on; None where the truth does not name objects."""

    def __post_init__(self) -> None:
        for array in vars(self).values():
            if isinstance(array, np.ndarray):
                array.setflags(write=False)


def surface_of(truth: Truth, path: Path | None = None) -> TrueSurface:
    """The surface of a scene, with its first object as `thing` where gt.npz at `path`, or in that
    folder, names objects.

    Raises:
        InputError: the objects cannot be read or have another shape than the labels.
    """
    return TrueSurface(
        normalize(truth.normals.reshape(-1, 3).astype(float)).reshape(truth.normals.shape),
        truth.mask,
        truth.depth.astype(float),
        truth.px_mm,
        (truth.lights.astype(float) * truth.power[:, None]).astype(np.float64),
        None if path is None else _read_thing(path, truth.mask),
    )


def _read_thing(path: Path, mask: NDArray[np.bool_]) -> NDArray[np.bool_] | None:
    file = path / "gt.npz" if path.is_dir() else path
    try:
        with np.load(file, allow_pickle=False) as stored:
            if OBJECTS not in stored:
                return None
            objects = np.asarray(stored[OBJECTS])
    except (OSError, ValueError, EOFError) as error:
        raise InputError(f"{file}: {OBJECTS} cannot be read; (H,W) numbers are accepted") from error
    if objects.shape != mask.shape or objects.dtype.kind not in "biu":
        raise InputError(
            f"{file}: {OBJECTS} is {objects.dtype} of shape {objects.shape}; whole numbers of "
            f"shape {mask.shape} are accepted"
        )
    return np.logical_and(mask, objects == 1)


def is_benchmark(path: Path) -> bool:
    """Whether `path` is a folder of the DiLiGenT benchmark, or its file of true normals."""
    return (path / BENCHMARK).is_file() if path.is_dir() else path.name == BENCHMARK


def read_benchmark(path: Path) -> TrueSurface:
    """Normal_gt.mat and light_directions.txt of DiLiGenT (Shi et al., PAMI 2019): its mask is where
    there are normals.

    Args:
        path: the folder, or the file of normals in it.

    Raises:
        InputError: no normals of shape (H,W,3), or lights that cannot be read.
    """
    from scipy.io import loadmat

    file = path / BENCHMARK if path.is_dir() else path
    try:
        normals = np.asarray(loadmat(file)["Normal_gt"], float)
    # whatever a damaged file makes scipy raise: zlib, struct, its own, and bare Exception
    except Exception as error:
        raise InputError(
            f"{file}: cannot be read as true normals; a MAT file with Normal_gt of shape (H,W,3) "
            "is accepted"
        ) from error
    if normals.ndim != 3 or normals.shape[2] != 3 or not np.isfinite(normals).all():
        raise InputError(
            f"{file}: Normal_gt is of shape {normals.shape} or not finite; (H,W,3) is accepted"
        )
    mask = (normals != 0).any(axis=2)
    if not mask.any():
        raise InputError(f"{file}: all normals are zero; unit vectors are accepted")
    lights = file.with_name(DIRECTIONS)
    return TrueSurface(
        normalize(normals.reshape(-1, 3)).reshape(normals.shape),
        mask,
        lights=read_table(lights)[1] if lights.is_file() else None,
    )
