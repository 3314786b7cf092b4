"""What can be taken home."""

from collections.abc import Callable

import viser

from photolin.export.maps import Convention

from ..downloads import REPORT, SHAPE
from ..figure import KINDS as FIGURES
from ..values import choose_option

RESULT = "result (npz and json, zip)"
SURFACE = "shape (maps and mesh, zip)"
PAGE = "report (one web page to send)"
KINDS = {
    "masks (PNG, zip)": "masks",
    "label maps (indexed PNG, zip)": "labels",
    "linearized (float32 TIFF)": "linearized",
    RESULT: "result",
    PAGE: REPORT,
    SURFACE: SHAPE,
    **{f"{kind} of the paper (PNG)": kind for kind in FIGURES},
}
FIXED = frozenset({"result", REPORT, SHAPE, *FIGURES})
"""Kinds whose images are not chosen."""
TEXT = """
- **masks**: for each class a picture that is white where a pixel belongs to it
- **label maps**: one picture for each image, in the colours of the legend; its pixel values are
  0 U, 1 D, 2 S, 3 A, 4 C, and 255 outside the mask
- **linearized**: diffuse reflection alone, signed, as fraction of full scale, not rounded
- **result**: what `photolin run` writes, of all images. result.npz holds labels, coefficients and
  linearized bases as NumPy arrays, report.json how they came about. Unpacked into a folder,
  `photolin inspect` opens them again
- **report**: pictures, shares, settings, your notes and the command that makes the result again,
  as a single page that needs no network
- **shape**: what `photolin shape` writes, once the tab Shape has recovered one. normals.tif,
  albedo.tif (in colour where the images are) and depth.tif are numbers, the PNGs to look at;
  mesh.ply and mesh.obj open in MeshLab or Blender; lights.lp is for RTI. x is right, y up, z to the
  camera. The result is in it too
- **figures**: of this stack, as in Mukaigawa et al. 2007. 6: label maps of this image by all
  methods, and the truth where it is known. 8: base images as photographed, and linearized by all
  methods; 15: linearized only. 10: this image, linearized, and where each class is, in black; 11:
  the same of all images. Methods that have not run yet run first

Labels are by T and Ts as the sliders stand, of the method shown. Files go where the browser keeps
its downloads.
"""
THIS, ALL = "this image", "all images"


class ExportView:
    """Choice of files and a download button."""

    def __init__(
        self,
        gui: viser.GuiApi,
        export: Callable[[str, bool], None],
        add_progress: Callable[[viser.GuiApi], None],
    ) -> None:
        self._kind = gui.add_dropdown("Files", tuple(KINDS), hint="What to save, see below")
        self._images = gui.add_dropdown(
            "Of", (THIS, ALL), hint="Result, report, shape and figures decide by themselves"
        )
        self._directx = gui.add_checkbox(
            "DirectX normals", False, visible=False, hint="Green is y down; else y up, as in OpenGL"
        )
        self._button = gui.add_button("Download", icon=viser.Icon.DOWNLOAD, hint="Key: E")
        add_progress(gui)

        @self._kind.on_update
        async def _(_: viser.GuiEvent) -> None:
            self._directx.visible = self._kind.value == SURFACE
            self._images.disabled = self.chosen()[0] in FIXED

        @self._button.on_click
        async def _(_: viser.GuiEvent) -> None:
            export(*self.chosen())

    def convention(self) -> Convention:
        """Of the picture of normals."""
        return "directx" if self._directx.value is True else "opengl"

    def explain(self, gui: viser.GuiApi) -> None:
        """Say what the files hold; long, and so below all else of the tab."""
        gui.add_markdown(TEXT)

    def chosen(self) -> tuple[str, bool]:
        """The kind of files, and whether of all images."""
        kind = choose_option(self._kind.value, tuple(KINDS), next(iter(KINDS)))
        return KINDS[kind], choose_option(self._images.value, (THIS, ALL), THIS) == ALL
