"""`python -m photolin` is `photolin`."""

import sys

from .cli import main

sys.exit(main())
