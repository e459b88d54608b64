"""Datasets: many demonstrations × robots × variations, resumable, over processes or machines."""

from omni_envs.generation.card import write_card
from omni_envs.generation.engines import ENGINES, run_local, run_ray
from omni_envs.generation.generate import generate
from omni_envs.generation.item import Item, make_item
from omni_envs.generation.manifest import Manifest
from omni_envs.generation.recipe import Recipe, SourceEntry, read_recipe

__all__ = [
    "ENGINES",
    "Item",
    "Manifest",
    "Recipe",
    "SourceEntry",
    "generate",
    "make_item",
    "read_recipe",
    "run_local",
    "run_ray",
    "write_card",
]
