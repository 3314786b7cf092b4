"""A TIFF file of many pages."""

from functools import partial
from pathlib import Path

import tifffile

from ..errors import InputError, PhotolinError
from .folder import check_count
from .layout import Frame, Layout
from .pictures import Picture, read_page


def find_pages(path: Path) -> Layout:
    """Recognise the pages of a TIFF file; previews of reduced size are passed over.

    Raises:
        InputError: not a TIFF file, truncated, or too few pages.
    """
    try:
        with tifffile.TiffFile(path) as tif:
            pages = [n for n, page in enumerate(tif.pages) if not _page(page).is_reduced]
            whole = _ends(tif)
    except Exception as error:  # tifffile raises whatever the broken bytes lead it to
        raise InputError(
            f"{path}: is truncated or not a TIFF file ({error}); a whole file is accepted"
        ) from error
    if not whole:
        raise InputError(f"{path}: is truncated (page {len(pages)}); a whole file is accepted")
    check_count(len(pages), path)
    frames = [
        Frame(f"page {k:03d}", f"{path}, page {k:03d}", partial(_read, path, n, k))
        for k, n in enumerate(pages, 1)
    ]
    return Layout(title=path.stem, where=path, frames=tuple(frames), files=(path,))


def _page(page: tifffile.TiffPage | tifffile.TiffFrame) -> tifffile.TiffPage:
    assert isinstance(page, tifffile.TiffPage)  # frames come only where they are asked for
    return page


def _ends(tif: tifffile.TiffFile) -> bool:
    """Whether the chain of pages ends with a zero; tifffile takes a broken one for its end."""
    file = tif.filehandle
    file.seek(tif.pages.next_page_offset or 0)
    return not any(file.read(tif.tiff.offsetsize))


def _read(path: Path, index: int, number: int) -> Picture:
    where = f"{path}, page {number:03d}"
    try:
        # A file of its own for each read: tifffile's pages are not safe to share between threads.
        with tifffile.TiffFile(path) as tif:
            return read_page(_page(tif.pages[index]), where)
    except (PhotolinError, MemoryError):
        raise
    except Exception as error:  # as above
        raise InputError(f"{where}: is truncated ({error}); a whole page is accepted") from error
