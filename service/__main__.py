"""``python -m service`` is the program ``slewline``."""

from __future__ import annotations

import sys

from service.commands.cli import main

if __name__ == "__main__":
    sys.exit(main())
