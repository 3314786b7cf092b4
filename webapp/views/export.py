"""What can be taken home."""

from collections.abc import Callable

import viser

from ..values import choose_option

KINDS = {
    "masks (PNG, zip)": "masks",
    "label maps (indexed PNG, zip)": "labels",
    "linearized (float32 TIFF)": "linearized",
    "everything (result.npz)": "result",
}
THIS, ALL = "this image", "all images"


class ExportView:
    """Choice of files and a download button."""

    def __init__(self, gui: viser.GuiApi, export: Callable[[str, bool], None]) -> None:
        self._kind = gui.add_dropdown(
            "Files",
            tuple(KINDS),
            hint="masks: one black and white picture for each class. label maps: pixel values "
            "0 U, 1 D, 2 S, 3 A, 4 C, 255 outside the mask. linearized: signed, fraction of full "
            "scale. result.npz: labels, coefficients and linearized bases as arrays",
        )
        self._images = gui.add_dropdown("Of", (THIS, ALL), hint="result.npz holds all images")
        self._button = gui.add_button("Download", icon=viser.Icon.DOWNLOAD, hint="Key: E")

        @self._button.on_click
        async def _(_: viser.GuiEvent) -> None:
            export(*self.chosen())

    def chosen(self) -> tuple[str, bool]:
        """The kind of files, and whether of all images."""
        kind = choose_option(self._kind.value, tuple(KINDS), next(iter(KINDS)))
        return KINDS[kind], choose_option(self._images.value, (THIS, ALL), THIS) == ALL
