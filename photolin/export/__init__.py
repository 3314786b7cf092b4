"""Every file a user takes away: results, label maps, masks, linearized images, surfaces."""

from .arrays import result_npz
from .files import (
    CONTENTS,
    Contents,
    export_files,
    label_png,
    linearized_tiff,
    mask_png,
    safe_name,
    write_files,
    zip_files,
)
from .report import program_version
from .result import (
    check_output,
    is_result,
    load_result,
    load_result_source,
    load_result_stack,
    load_shape,
    result_files,
    save_result,
)
from .shape import shape_files

__all__ = [
    "CONTENTS",
    "Contents",
    "check_output",
    "export_files",
    "is_result",
    "label_png",
    "linearized_tiff",
    "load_result",
    "load_result_source",
    "load_result_stack",
    "load_shape",
    "mask_png",
    "program_version",
    "result_files",
    "result_npz",
    "safe_name",
    "save_result",
    "shape_files",
    "write_files",
    "zip_files",
]
