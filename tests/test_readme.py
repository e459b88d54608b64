"""What the README tells users to type exists: commands with their flags, imports, options."""

import ast
import re
import shlex
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
import tyro

import omni_envs  # noqa: F401  (registers the environments)
from omni_envs.cli import Command
from omni_envs.references import reference_from_qpos
from omni_envs.robots import G1

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
TEXT = "\n".join(page.read_text() for page in PAGES)
BLOCKS = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
WORDS = [
    shlex.split(line.removeprefix("$ "), comments=True)
    for line in TEXT.splitlines()
    if line.startswith(("$ omni-envs ", "$ python train.py "))
]
CONFIG = (tyro.conf.OmitArgPrefixes, tyro.conf.OmitSubcommandPrefixes)


def test_there_is_something_to_check():
    assert len(WORDS) >= 15 and len(BLOCKS) >= 4


@pytest.mark.parametrize("words", WORDS, ids=" ".join)
def test_commands_are_understood(words):
    if words[0] == "python":
        sys.path.insert(0, str(ROOT))
        from train import Arguments

        assert tyro.cli(Arguments, args=words[2:]).steps > 0
    else:
        command = tyro.cli(Command, args=words[1:], config=CONFIG)
        assert callable(command.run)


@pytest.mark.parametrize("block", BLOCKS, ids=lambda b: b.split("\n")[0])
def test_imports_exist(block):
    tree = ast.parse(block)
    for node in tree.body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            root = (getattr(node, "module", None) or node.names[0].name).split(".")[0]
            pytest.importorskip(root)
            exec(compile(ast.Module([node], []), "README", "exec"), {})


def test_the_options_of_the_example_are_options(tmp_path):
    (block,) = (b for b in BLOCKS if 'preset="paper"' in b)
    reference = reference_from_qpos(G1, 50.0, np.tile(G1.default_qpos, (30, 1)))
    path = reference.save(tmp_path / "my_reference.npz")
    names = {"gymnasium": gym}
    exec(block.replace("my_reference.npz", str(path)), names)
    seen, _ = names["env"].reset(seed=0)
    assert {key: part.shape for key, part in seen.items()} == {"policy": (160,), "critic": (286,)}
    names["env"].close()
