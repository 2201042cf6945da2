"""The house rules: public names are documented and complete, imports run one way."""

import ast
import graphlib
import inspect
import re
import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path

import pytest

import wfluid

ROOT = Path(__file__).parents[1]

FLOORS = [
    {"kernels", "system", "optimize", "domain"},
    {"fields", "pictures"},
    {"model", "solve", "files"},
    {"step", "view", "scene"},
    {"animation", "gradient"},
    {"keyframes"},
    {"morphing"},
    {"staging"},
    {"cli"},
]
"""The packages from the ground up: each imports from lower floors only."""

FLOOR = {name: number for number, names in enumerate(FLOORS, start=1) for name in names}


@pytest.mark.parametrize("name", [name for name in wfluid.__all__ if name != "__version__"])
def test_every_public_name_exists_and_is_documented(name):
    thing = getattr(wfluid, name)
    assert thing is getattr(import_module(wfluid._homes()[name]), name)
    assert inspect.getdoc(thing)
    if inspect.isclass(thing):
        for attribute, value in vars(thing).items():
            if not attribute.startswith("_") and inspect.isfunction(value):
                assert inspect.getdoc(value), f"{name}.{attribute} has no docstring"


def test_the_types_of_every_public_name_are_checked():
    """`.ci/run` has mypy and pyright check tests/typing/public_names.py."""
    tree = ast.parse((ROOT / "tests/typing/public_names.py").read_text())
    used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    assert {*wfluid.__all__} - used == {"__version__"}


def test_every_package_is_installed():
    """A folder of modules that pyproject.toml does not name is missing from the wheel."""
    named = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    folders = {f"wfluid.{path.parent.name}" for path in ROOT.glob("wfluid/*/__init__.py")}
    device_code = {f"wfluid.kernels.{path.parent.name}" for path in ROOT.glob("kernels/*/__init__.py")}
    assert set(named) == {"wfluid", "wfluid.kernels", *folders, *device_code}


def test_unknown_names_are_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = wfluid.nothing


def imported_by(path):
    """Modules of the package that a file imports."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("wfluid"):
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def test_device_code_knows_no_host_code():
    for path in (ROOT / "kernels").rglob("*.py"):
        for module in imported_by(path):
            assert module.startswith("wfluid.kernels"), f"{path.name} imports {module}"


SYMBOL = re.compile(
    r"""[A-Z][a-z]?(?:_\w+)?\s+(?:[-+*/]?=|[-+*/]\s)   # X = …, X += …, V - grad q
      | (?:Out|Mu|Beta|Alpha|Lambda|Length|Ratio|Sinc)(?:\s+[-+]?=|\()
      | (?:Dt|Rz)\b
      | [A-Z][xy]\s*\(                               # Ax (x_west + …
      | [B-HJ-Z]\s+(?:mod|rounded|of)\b""",
    re.VERBOSE,
)
"""A formula, or a symbol of one letter, that begins with a capital."""


@pytest.mark.parametrize("text", ["X = A^-1 b", "Out = f", "V - grad q", "Ax (x_west)", "Rz of", "N rounded"])
def test_a_capitalised_symbol_is_found(text):
    assert SYMBOL.match(text)


@pytest.mark.parametrize("folder", ["kernels", "wfluid"])
def test_docstrings_leave_symbols_as_they_are(folder):
    """`ax` is a coefficient, `A x` an operator's product: a docstring begins with the symbol itself."""
    wrong = [
        f"{path.relative_to(ROOT)}: {text.splitlines()[0]}"
        for path in (ROOT / folder).rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.FunctionDef | ast.ClassDef)
        for text in [ast.get_docstring(node) or ""]
        if SYMBOL.match(text)
    ]
    assert not wrong, "\n".join(wrong)


def test_arrays_are_made_and_written_in_one_file():
    """What `fields/arrays` does holds the lock that keeps it out of another thread's capture."""
    makes = {"zeros", "ones", "full", "empty", "array", "copy", "clone", "zeros_like", "empty_like", "launch"}
    writes = {"assign", "fill_"}
    wrong = []
    for path in sorted((ROOT / "wfluid").rglob("*.py")):
        if path.relative_to(ROOT) == Path("wfluid/fields/arrays.py"):
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                of_warp = isinstance(node.func.value, ast.Name) and node.func.value.id == "wp"
                if (of_warp and node.func.attr in makes) or node.func.attr in writes:
                    wrong.append(f"{path.relative_to(ROOT)}:{node.lineno} calls {node.func.attr}")
    assert not wrong, "\n".join(wrong)


def packages_imported_by(path):
    """Packages of wfluid that a file imports."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "wfluid":
            deeper = node.module.split(".")[1:]
            names = deeper[:1] or (alias.name for alias in node.names)
        elif isinstance(node, ast.Import):
            names = (alias.name.split(".")[1] for alias in node.names if alias.name.startswith("wfluid."))
        else:
            continue
        yield from (name for name in names if (ROOT / "wfluid" / name).is_dir() or name == "kernels")


def test_imports_run_one_way():
    wrong = [
        f"{path.relative_to(ROOT)} (floor {FLOOR[own]}) imports {other} (floor {FLOOR[other]})"
        for path in sorted((ROOT / "wfluid").glob("*/*.py"))
        for own in [path.parent.name]
        for other in packages_imported_by(path)
        if other != own and FLOOR[other] >= FLOOR[own]
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(
    "path", [*ROOT.glob("wfluid/**/*.py"), *ROOT.glob("kernels/**/*.py")], ids=lambda path: path.name
)
def test_a_file_tells_one_story(path):
    """A longer file tells two."""
    assert len(path.read_text().splitlines()) <= 400


def test_every_package_has_a_floor():
    folders = {path.parent.name for path in ROOT.glob("wfluid/*/__init__.py")}
    assert {*FLOOR} == folders | {"kernels"}


def test_files_of_a_package_import_each_other_without_a_circle():
    """graphlib refuses a circle and names it."""
    for package in sorted(path.parent for path in ROOT.glob("wfluid/*/__init__.py")):
        stems = {path.stem for path in package.glob("*.py")}
        home = f"wfluid.{package.name}"
        imports = {
            path.stem: {
                module.removeprefix(home + ".").partition(".")[0]
                for module in imported_by(path)
                if module.startswith(home + ".")
            }
            & stems
            for path in package.glob("*.py")
        }
        list(graphlib.TopologicalSorter(imports).static_order())


@pytest.mark.parametrize("name", ["domain", "pictures", "model", "scene", "files", "optimize", "system"])
def test_descriptions_load_no_warp(name):
    """What says how a shot looks can be read, checked and written on a machine without Warp."""
    modules = [f"wfluid.{name}.{path.stem}" for path in (ROOT / "wfluid" / name).glob("*.py")]
    code = f"import sys, {', '.join(modules)}; sys.exit('warp' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


@pytest.mark.parametrize(
    ("library", "home"),
    [
        ("OpenImageIO", {"reading", "stills", "encoder", "gif", "preview", "report", "picture"}),
        ("av", {"movie"}),
        ("matplotlib", {"plot"}),
    ],
)
def test_heavy_libraries_are_imported_by_their_wrappers_only_and_late(library, home):
    for path in (ROOT / "wfluid").rglob("*.py"):
        tree = ast.parse(path.read_text())
        assert library not in libraries(ast.walk(tree)) or path.stem in home, f"{path.name} imports {library}"
        assert library not in libraries(tree.body)


def libraries(nodes):
    """What the import statements among some nodes import."""
    names = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module)
    return {name.partition(".")[0] for name in names}
