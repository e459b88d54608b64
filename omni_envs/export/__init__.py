"""Policies out: files for deploy stacks, each proved against the network it came from."""

from omni_envs.export.run import PROFILES, export_run

__all__ = ["PROFILES", "export_run"]
