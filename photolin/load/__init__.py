"""Everything that reads a user's files, whatever the layout; colour one channel at a time.

================  ==================================================================================
layout            what is read
================  ==================================================================================
folder            PNG, TIFF, JPEG, TGA, BMP, PGM and PPM in natural order (img2 before img10); where
                  there are none, those of the sub-folder ``images``
folder, DiLiGenT  images that ``filenames.txt`` lists, divided by ``light_intensities.txt``
multi-page TIFF   one image for each page
.npy              (images, rows, columns) or (images, rows, columns, channels)
.npz              ``images`` as in .npy; ``mask``, ``lights`` and ``names`` where present
================  ==================================================================================

In a folder, names decide: ``*mask*`` is the mask, ``*ambient*`` and ``*dark*`` are dark frames,
``*normal*``, ``gt*`` and hidden files are no images, and of the rest the largest group that shares
a numbered name (``light01`` to ``light10``) is the stack. ``light_directions.txt``, ``lights.txt``,
``lights.npy`` or an ``.lp`` file beside the images gives the lights.
"""

from .assemble import load_stack
from .channels import ChannelImages, load_channels
from .options import LoadOptions

__all__ = ["ChannelImages", "LoadOptions", "load_channels", "load_stack"]
