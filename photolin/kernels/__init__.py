"""The compiled loops: plain arrays in, plain arrays out, no policy.

All run without the interpreter lock on a range of rows, so that `photolin.blocks.run_blocks` can
spread them over threads; each row depends on nothing but its own data and the seed, hence the
result does not depend on threads or block size. Every loop has a plain-numpy twin in the tests.

Both halves of the method are one problem. A *row* of observations x (M,) is explained by *factors*
A (M,3) and an unknown v (3,): x = A v wherever reflection is diffuse. For a pixel the observations
are its K images, A the coefficients and v its linearized bases (Eq. 6). For an image the
observations are its P pixels, A the bases and v its coefficients (Eq. 5).

A dark observation (i < Ts) is A or C whatever v says, so it adds the same constant to the support
of every candidate: only lit observations are ever compared.
"""

from pathlib import Path

from .cache import choose_cache

choose_cache(Path(__file__).parent)

from .consensus import consensus_rows, score_candidates  # noqa: E402
from .diffuse import diffuse_rows  # noqa: E402
from .evidence import evidence_rows  # noqa: E402
from .fine import fine_band  # noqa: E402
from .grazing import grazing_rows  # noqa: E402
from .labels import label_rows  # noqa: E402
from .neighbours import settle_rows  # noqa: E402
from .pooled import clear_tile, pooled_tile  # noqa: E402
from .samples import centre_path, centre_rows, support_rows  # noqa: E402
from .trust import trust_rows  # noqa: E402

__all__ = [
    "centre_path",
    "centre_rows",
    "clear_tile",
    "consensus_rows",
    "diffuse_rows",
    "evidence_rows",
    "fine_band",
    "grazing_rows",
    "label_rows",
    "pooled_tile",
    "score_candidates",
    "settle_rows",
    "support_rows",
    "trust_rows",
]
