"""``python -m omni_envs.cli``."""

import sys

from omni_envs.cli import main

if __name__ == "__main__":
    sys.exit(main())
