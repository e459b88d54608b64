"""The house rules that a reader relies on: one-way imports, light import, no private reaching."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "omni_envs"

# Every room may import from the rooms before it, never from those after it.
ORDER = (
    "errors",
    "files",
    "rotations",
    "resampling",
    "progress",
    "threads",
    "compilation",
    "processes",
    "registration",
    "robots",
    "scenes",
    "demonstrations",
    "retargeting",
    "metrics",
    "references",
    "tracking",
    "envs",
    "training",
    "export",
    "viewer",
    "generation",
    "benchmarks",
    "demo",
    "publish",
    "cli",
)
HEAVY = {
    "torch", "stable_baselines3", "torchrl", "tensordict", "placo", "viser", "onnx", "onnxruntime",
    "matplotlib", "imageio", "tensorboard", "ray", "warp", "numba",
}  # fmt: skip


def imports() -> list[tuple[Path, str, list[str]]]:
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                found += [(path, alias.name, []) for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                assert node.level == 0, f"{path}: relative import"
                found.append((path, node.module or "", [a.name for a in node.names]))
    return found


def room(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def test_every_room_is_in_the_order():
    rooms = {room(p) for p in PACKAGE.rglob("*.py")} - {"__init__"}
    assert rooms <= set(ORDER), f"rooms without a place in the order: {rooms - set(ORDER)}"


def test_imports_flow_one_way():
    backwards = []
    for path, module, names in imports():
        if not module.startswith("omni_envs") or room(path) == "__init__":
            continue
        targets = [module.split(".")[1]] if "." in module else names
        backwards += [
            f"{path.relative_to(PACKAGE)} imports {module}"
            for target in targets
            if target in ORDER and ORDER.index(target) > ORDER.index(room(path))
        ]
    assert not backwards, "\n".join(backwards)


def test_no_package_reaches_into_private_names_of_another():
    reached = [
        f"{path.relative_to(PACKAGE)}: {module}.{name}"
        for path, module, names in imports()
        if module.startswith("omni_envs.")
        for name in [*module.split("."), *names]
        if name.startswith("_")
        and not name.startswith("__")
        and module.split(".")[1].removesuffix(".py") != room(path)
    ]
    assert not reached, "\n".join(reached)


def test_import_is_light():
    code = f"import sys, omni_envs; print(sorted({HEAVY!r} & set(sys.modules)))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


@pytest.mark.parametrize("word", ["TODO", "FIXME", "XXX"])
def test_no_unfinished_work(word):
    assert not [str(p) for p in PACKAGE.rglob("*.py") if word in p.read_text()]
