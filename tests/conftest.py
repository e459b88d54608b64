"""Imported before any test module, so that MuJoCo finds the graphics library that works here."""

import omni_envs  # noqa: F401
