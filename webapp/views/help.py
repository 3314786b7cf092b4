"""How to use the tool, on one page."""

import viser

from ..keys import tabulate_keys

TEXT = """
Every pixel of every image is labelled **D** diffuse, **S** specular, **A** attached shadow
(the surface faces away from the light), **C** cast shadow (something blocks the light) or **U**
undefined. Move **T** and **Ts** until the labels look right, click pixels to see why they are what
they are, then export.

**Mouse.** Left-drag moves the picture, the wheel zooms at the pointer, a double click fits, a click
selects a pixel. While samples are taken a left-drag draws a rectangle, and Shift-drag or right-drag
moves. In 3D left-drag turns, right-drag moves, the wheel zooms, a click selects the pixel, F and a
double click look from the front again.

{keys}

**Live.** While it is on, everything is linearized again as a slider moves: a *preview* of what is
on screen at once, the *final* result of the whole stack when the slider rests. With *live* off the
labels alone follow until you linearize again.

**Views.** *input* is the photograph, *linearized* what it would be with diffuse reflection alone
(mid-grey is zero), *residual* the difference.
Sentences in yellow under *About this result* say what is doubtful.

**Overview** shows all images at once, with the shares of their classes and with what is wrong
with them: saturated, moved, a copy of another, another exposure, a bad fit. A click goes to an
image, a click on its corner leaves it out or takes it in again; then all is linearized anew. The
view *how often* shows in how many images each pixel is specular, lit or in shadow.

**Shape** goes on from there, to the surface and to the lights. It takes what is known of the
scene: the lights, or those of some images; five points on a sphere, a whole sphere, or normals of
some pixels; or nothing. A click on *Recover shape* gives normals, albedo and depth, and the views
*albedo*, *normals*, *depth* and *relit*. *relit* is
the scene under a light of your own: drag the yellow spot on the ball in the corner, its middle is
light from the camera and its rim light from the side. *3D* lays the picture on the surface.

**Compare** sets another layer, another method or the true labels beside what is shown: split
at a line that you drag on the picture, side by side with one zoom for both, as a difference, or in
turn (key B). Tables tell how many labels differ. *Export* draws the figures of the paper.

**Units.** Intensities are fractions of full scale; pixels are (row, column) from the upper left
corner; in space x is right, y up, z to the camera.
""".replace("{keys}", tabulate_keys())


class HelpView:
    """The text."""

    def __init__(self, gui: viser.GuiApi) -> None:
        gui.add_markdown(TEXT)
