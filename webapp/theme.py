"""Dark or light, for everything in the page."""

import viser

from .state import Theme


def set_theme(gui: viser.GuiApi, theme: Theme) -> None:
    """Show panel, canvas and plots on a dark or a light ground."""
    gui.configure_theme(
        control_width="large",
        show_logo=False,
        show_share_button=False,
        dark_mode=theme == "dark",
    )
