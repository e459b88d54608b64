"""Compiled loops on disk: never those of an earlier source, and told when they are made."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

from omni_envs import compilation
from omni_envs.retargeting import kernels as retargeting_kernels
from omni_envs.tracking.kernels.compiled import compiled as tracking

CALLER = """
import sys
from omni_envs.compilation import Compiler
from called import FACTOR, inner

{decorator}
def outer(x):
    return inner(x) * FACTOR

print(outer(3.0), sum(outer.stats.cache_hits.values()))
"""
CALLED = """
from numba import njit

FACTOR = {factor}

@njit
def inner(x):
    return x + {term}
"""
OURS = "@Compiler('.')"
NUMBAS = "from numba import njit\n@njit(cache=True)"


def _run(folder: Path, decorator: str = OURS, factor: float = 1.0, term: float = 0.0, **env):
    (folder / "caller.py").write_text(CALLER.format(decorator=decorator))
    (folder / "called.py").write_text(CALLED.format(factor=factor, term=term))
    done = subprocess.run(
        [sys.executable, "caller.py"],
        cwd=folder,
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1", **env},
        capture_output=True,
        text=True,
        check=True,
    )
    value, hits = done.stdout.split()
    return float(value), int(hits), done.stderr


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    return tmp_path


def test_a_change_of_another_file_is_seen(folder):
    assert _run(folder)[:2] == (3.0, 0)
    assert _run(folder)[:2] == (3.0, 1)
    assert _run(folder, term=1.0)[:2] == (4.0, 0)
    assert _run(folder, term=1.0, factor=2.0)[:2] == (8.0, 0)
    assert _run(folder, term=1.0, factor=2.0)[:2] == (8.0, 1)
    assert _run(folder)[:2] == (3.0, 0)


def test_numbas_own_cache_would_not_see_it(folder):
    """The reason for ours; once this fails, it may go."""
    assert _run(folder, NUMBAS)[:2] == (3.0, 0)
    assert _run(folder, NUMBAS, term=1.0)[:2] == (3.0, 1)


def test_compiling_is_told_once_and_only_when_it_happens(folder):
    first, second = _run(folder)[2], _run(folder)[2]
    assert first == (
        "omni_envs: compiling inner loops for this machine; this takes some seconds, once.\n"
    )
    assert second == ""


def test_where_nothing_can_be_written_every_process_compiles(folder, monkeypatch, capsys):
    def no_place(*_):
        raise RuntimeError("cannot cache function: no locator available")

    monkeypatch.setattr(compilation.FunctionCache, "__init__", no_place)
    monkeypatch.setattr(compilation, "_told", False)
    half = compilation.Compiler(__file__)(lambda x: 0.5 * x)
    assert half(3.0) == 1.5 and half(4) == 2.0
    told = capsys.readouterr().err
    assert told.count("\n") == 1 and "no folder to keep the result in" in told


def test_workers_leave_the_telling_to_the_program(monkeypatch, capsys):
    monkeypatch.setattr(compilation, "_told", False)
    monkeypatch.setattr(compilation, "parent_process", lambda: object())
    compilation._tell("it takes long")
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("compiler", [tracking, retargeting_kernels._compiled])
def test_what_compiled_loops_are_made_of_is_among_their_sources(compiler):
    """A name from elsewhere would be compiled in, and a change of it not be seen."""
    package = Path(compilation.__file__).parents[1]
    kernels = [s for s in compiler.sources if "kernels" in s.relative_to(package).as_posix()]
    assert kernels
    outside = []
    for file in kernels:
        for node in ast.walk(ast.parse(file.read_text())):
            if not isinstance(node, ast.ImportFrom) or not node.module.startswith("omni_envs"):
                continue
            stem = package / node.module.replace(".", "/")
            files = {stem.with_suffix(".py"), stem / "__init__.py"}
            if node.module != "omni_envs.compilation" and not files & set(compiler.sources):
                outside.append(f"{file.name} imports {node.module}")
    assert not outside
