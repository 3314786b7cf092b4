"""A scene on disk: images, gt.npz and a README."""

import os
import shutil
import zipfile
import zlib
from pathlib import Path

import numpy as np

from ..errors import InputError, OutputError
from ..factors import LETTERS, OUTSIDE, Factor
from .render import Scene, Truth

KEYS = tuple(Truth.__dataclass_fields__)
"""The arrays of gt.npz, named as the fields of Truth."""

UNREADABLE = (
    OSError,
    EOFError,
    ValueError,
    TypeError,
    RuntimeError,
    MemoryError,
    zipfile.BadZipFile,
    zlib.error,
)
"""What numpy raises for a truncated, damaged, encrypted, pickled or other file."""

README = """{title}: a rendered image stack with exact ground truth (photolin.synthetic)
{K} images of {H} x {W} pixels (rows x columns), {px_mm:g} mm a pixel; orthographic camera, one
distant light for each image.

images/   {bits}-bit linear gray PNG; value / {full} = fraction of full scale
mask.png  the object's pixels (255), where the mask is not the whole picture
gt.npz    labels   (K,H,W) uint8: 1 diffuse; 2 specular (highlight above 0.5 % of full scale and 2 %
                   of the diffuse part); 3 attached shadow (n.s <= 0); 4 cast shadow (n.s > 0,
                   occluded); 255 outside the mask
          ideal    (K,H,W) albedo * power * (n.s), signed, not clipped; 1 = full scale
          normals  (H,W,3) unit;  albedo (H,W);  depth (H,W) z in mm, NaN outside the mask
          lights   (K,3) unit, towards the light;  power (K,);  mask (H,W);  px_mm
axes      x right, y up (the row decreases), z to the camera;
          x = (column + .5 - W/2) * px_mm, y = (H/2 - row - .5) * px_mm
model     image = min(1, (albedo * power * max(0, n.s) + highlight) * visible)
labels    {shares} (percent of the mask's pixels, all images)
"""


def write_scene(scene: Scene, folder: str | os.PathLike[str], *, lights: bool = False) -> None:
    """Write images/000.png ..., gt.npz, README.txt, and mask.png where the mask leaves pixels out.

    With `lights` also lights.txt, ``name x y z``, directions times powers.
    Images are PNG of the scene's bits, 16 where it is not quantised. The folder appears whole or
    not at all.

    Raises:
        OutputError: the folder exists, or cannot be written.
    """
    folder = Path(folder)
    if os.path.lexists(folder):
        raise OutputError(f"{folder}: exists already; a folder that does not exist is accepted")
    draft = folder.with_name(f".{folder.name}.{os.getpid()}")
    try:
        (draft / "images").mkdir(parents=True)
        _fill(scene, draft)
        if lights:
            (draft / "lights.txt").write_text(_list_lights(scene))
        os.replace(draft, folder)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written: {error.strerror}") from error
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _list_lights(scene: Scene) -> str:
    truth = scene.truth
    vectors = truth.lights.astype(np.float64) * truth.power.astype(np.float64)[:, None]
    return "".join(
        f"{name} {x:.9g} {y:.9g} {z:.9g}\n"
        for name, (x, y, z) in zip(scene.stack.names, vectors, strict=True)
    )


def _fill(scene: Scene, folder: Path) -> None:
    from imagecodecs import png_encode

    stack, truth = scene.stack, scene.truth
    K, H, W = stack.shape
    bits = scene.bits or 16
    full = 2**bits - 1
    dtype = np.uint8 if bits == 8 else np.uint16
    for name, image in zip(stack.names, stack.images, strict=True):
        counts = np.round(image.astype(np.float64) * full).astype(dtype)
        (folder / "images" / name).write_bytes(png_encode(counts, level=9))
    if not truth.mask.all():
        (folder / "mask.png").write_bytes(png_encode(truth.mask.astype(np.uint8) * 255, level=9))
    np.savez_compressed(folder / "gt.npz", **{key: getattr(truth, key) for key in KEYS})
    inside = truth.labels[:, truth.mask]
    shares = ", ".join(
        f"{letter} {100 * (inside == factor).mean():.2f}"
        for factor, letter in LETTERS.items()
        if letter != "U"
    )
    text = README.format(
        title=stack.title, K=K, H=H, W=W, px_mm=truth.px_mm, bits=bits, full=full, shares=shares
    )
    (folder / "README.txt").write_text(text)


def load_truth(path: str | os.PathLike[str]) -> Truth:
    """Read gt.npz, given itself or the folder that holds it.

    Raises:
        InputError: there is none, it cannot be read, or its arrays are missing or do not fit.
    """
    path = Path(path)
    if path.is_dir():
        path = path / "gt.npz"
    if not path.is_file():
        raise InputError(f"{path}: not found; a gt.npz, or the folder that holds one, is accepted")
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as stored:
            missing = [key for key in KEYS if key not in stored]
            arrays = {key: stored[key] for key in KEYS if key in stored}
    except UNREADABLE as error:
        raise InputError(f"{path}: cannot be read as ground truth; a gt.npz is accepted") from error
    if missing:
        raise InputError(f"{path}: has no {', '.join(missing)}; accepted are {', '.join(KEYS)}")
    return _check_truth(arrays, path)


def _check_truth(arrays: dict[str, np.ndarray], path: Path) -> Truth:
    if arrays["labels"].ndim != 3:
        raise InputError(f"{path}: labels have {arrays['labels'].ndim} axes; (K,H,W) is accepted")
    K, H, W = arrays["labels"].shape
    expected = {
        "labels": ((K, H, W), np.uint8),
        "ideal": ((K, H, W), np.float32),
        "normals": ((H, W, 3), np.float32),
        "albedo": ((H, W), np.float32),
        "depth": ((H, W), np.float32),
        "lights": ((K, 3), np.float32),
        "power": ((K,), np.float32),
        "mask": ((H, W), np.bool_),
        "px_mm": ((), np.float64),
    }
    for key, (shape, _) in expected.items():
        if arrays[key].shape != shape or arrays[key].dtype.kind not in "biuf":
            raise InputError(
                f"{path}: {key} is {arrays[key].dtype} of shape {arrays[key].shape}; "
                f"numbers of shape {shape}, to fit the labels, are accepted"
            )
    if (wrong := _find_wrong_values(arrays)) is not None:
        raise InputError(f"{path}: {wrong} is accepted")
    with np.errstate(over="ignore", invalid="ignore"):  # in what is not measured against
        arrays = {key: arrays[key].astype(dtype) for key, (_, dtype) in expected.items()}
    arrays["labels"][:, ~arrays["mask"]] = OUTSIDE
    return Truth(px_mm=float(arrays.pop("px_mm")), **arrays)


def _find_wrong_values(arrays: dict[str, np.ndarray]) -> str | None:
    """What a result cannot be measured against, and what can instead."""
    mask = arrays["mask"].astype(bool)
    labels, ideal, lights = arrays["labels"][:, mask], arrays["ideal"][:, mask], arrays["lights"]
    if not np.isin(labels, tuple(Factor)).all() or not labels.any():
        return "labels hold no class, or others than 0 to 4, in the mask; a class for each pixel"
    if not (np.abs(ideal) < np.finfo(np.float32).max).all():
        return "ideal holds NaN or infinity in the mask; a number for each pixel"
    if not (np.abs(lights) < 1e9).all() or not lights.any(axis=1).all():
        return "a light is zero or not finite; a direction for each image"
    return None
