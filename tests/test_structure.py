"""The house: who may import whom, what importing costs, what is public."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path
from types import ModuleType

import pytest

import photolin

ROOT = Path(__file__).parent.parent

FLOORS = (
    ("allocator", "priority", "errors", "factors", "stack", "analysis", "observations"),
    ("compiling",),
    ("kernels", "blocks", "consensus", "sample"),
    ("load", "synthetic", "command"),
    ("bases", "factorize", "refine", "coefficients", "settle", "refit", "fine", "saturation"),
    ("robust", "label", "shadow_level", "thresholds"),
    ("linearize", "follow", "residuals"),
    ("near_light", "dimensions", "confidence"),
    ("landscape", "overview", "candidates"),
    ("shape", "oracle", "evaluate", "paper", "light_powers"),
    ("pipeline",),
    ("export",),
    ("panels",),
    ("figures",),
    ("kinds", "console"),
    ("verbs",),
    ("cli",),
    ("__init__", "__main__"),
)
"""Rooms of photolin, lowest first; a room imports only from rooms named before it."""

PHOTOLIN = sorted((ROOT / "photolin").rglob("*.py"))
WEBAPP = sorted((ROOT / "webapp").rglob("*.py"))


def imports(file: Path) -> Iterator[tuple[str, bool]]:
    """Full name of each module a file imports, and whether it does so inside a function."""
    tree = ast.parse(file.read_text())
    package = file.relative_to(ROOT).with_suffix("").parts[:-1]
    inside = {
        id(node)
        for function in ast.walk(tree)
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef)
        for node in ast.walk(function)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, id(node) in inside) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) + 1 - node.level] if node.level else ()
            base = ".".join([*above, *([node.module] if node.module else [])])
            for alias in node.names:
                yield f"{base}.{alias.name}", id(node) in inside


def room(package: str, module: str) -> str:
    """`stack` of `photolin.stack.ImageStack`; `__init__` of names the package itself gives."""
    name = [*module.split("."), ""][1]
    source = ROOT / package / name
    return name if name and (source.is_dir() or source.with_suffix(".py").exists()) else "__init__"


@pytest.mark.parametrize("file", PHOTOLIN, ids=lambda f: str(f.relative_to(ROOT)))
def test_a_room_imports_only_from_lower_floors(file: Path) -> None:
    order = [name for floor in FLOORS for name in floor]
    here = file.relative_to(ROOT / "photolin").parts[0].removesuffix(".py")
    assert here in order, f"{here} has no floor yet: give it one in FLOORS"
    for module, _ in imports(file):
        if module.split(".")[0] == "photolin":
            there = room("photolin", module)
            assert there == here or order.index(there) < order.index(here), f"{here} uses {module}"


def test_the_rooms_of_the_web_tool_import_each_other_one_way_only() -> None:
    above: dict[str, set[str]] = {}
    for file in WEBAPP:
        here = file.relative_to(ROOT / "webapp").parts[0].removesuffix(".py")
        found = {room("webapp", module) for module, _ in imports(file) if "webapp" in module}
        above.setdefault(here, set()).update(found - {here, "__init__"})
    TopologicalSorter(above).prepare()  # raises CycleError
    assert all("app" not in below for below in above.values())


def test_only_the_verb_inspect_knows_the_web_tool() -> None:
    found = [
        (file.name, module, inside)
        for file in PHOTOLIN
        for module, inside in imports(file)
        if module.split(".")[0] in ("webapp", "viser")
    ]
    assert {(name, inside) for name, _, inside in found} == {("inspect.py", True)}
    assert all(module.startswith("webapp.") for _, module, _ in found)


def test_importing_photolin_brings_no_web_tool_and_no_plots() -> None:
    code = (
        "import sys, time, numpy, numba; start = time.process_time(); import photolin;"
        "print(time.process_time() - start, *sys.modules)"
    )
    ran = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    seconds, *modules = ran.stdout.split()
    loaded = {name.split(".")[0] for name in modules}
    assert "photolin" in loaded
    assert not loaded & {"webapp", "viser", "matplotlib", "tyro", "websockets"}
    assert float(seconds) < 0.5


def test_all_lists_exactly_the_public_names() -> None:
    public = {
        name
        for name, value in vars(photolin).items()
        if not name.startswith("_") and not isinstance(value, ModuleType)
    }
    listed = [name for name in photolin.__all__ if name != "__version__"]
    assert len(set(listed)) == len(listed)
    assert set(listed) == public
    assert {"analyze", "load_stack", "save_result", "load_result"} <= public


def test_readme_and_the_integration_script_run_the_same_tests() -> None:
    command = "python -m pip install '.[test]' && python -m pytest"
    assert command in (ROOT / "README.md").read_text()
    assert f"\n{command}\n" in (ROOT / ".ci" / "run").read_text()


def test_every_module_says_what_it_is_for() -> None:
    files = [file for file in (*PHOTOLIN, *WEBAPP) if file.stat().st_size]
    assert [f for f in files if not ast.get_docstring(ast.parse(f.read_text()))] == []
