"""The house rules: public names are documented and complete, imports run one way."""

import ast
import inspect
import tomllib
from pathlib import Path

import pytest

import wfluid

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("name", [name for name in wfluid.__all__ if name != "__version__"])
def test_every_public_name_exists_and_is_documented(name):
    thing = getattr(wfluid, name)
    assert inspect.getdoc(thing)
    if inspect.isclass(thing):
        for attribute, value in vars(thing).items():
            if not attribute.startswith("_") and inspect.isfunction(value):
                assert inspect.getdoc(value), f"{name}.{attribute} has no docstring"


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


@pytest.mark.parametrize(
    ("library", "home"),
    [
        ("OpenImageIO", {"stills", "gif", "preview", "report", "picture"}),
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
