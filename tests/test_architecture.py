"""The house rules that a program can check: floors, sizes, names, docstrings."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / "wentry_cli"
FILES = sorted(PACKAGE.rglob("*.py"))
NUMERICS = {"imaging", "contours", "tracking", "cavity", "kinematics", "mechanics", "scaling"}
BANNED = {"utils", "util", "helpers", "helper", "common", "misc", "core", "base"}
# what each room may import from the package, besides itself
GROUND = {
    "errors",
    "schemas",
    "columns",
    "tables",
    "number_text",
    "config",
    "pipeline",
    "provenance",
    "doubts",
    "records",
    "compiled",
    "progress",
    "__init__",
}
ALLOWED = {
    **dict.fromkeys(NUMERICS, NUMERICS | {"compiled", "errors"}),
    "frames": {"errors", "compiled"},
    "synthetic": {"errors", "compiled", "tables", "config", "progress"},
    "report": GROUND | NUMERICS | {"frames"},
    "stages": GROUND | NUMERICS | {"frames", "report"},
    "comparison": GROUND,
    "bench": GROUND | NUMERICS | {"synthetic", "frames", "stages"},
    "runner": GROUND | {"stages", "frames"},
    "cli": GROUND | {"stages", "runner", "frames", "synthetic", "comparison", "bench"},
    "config": GROUND,
    **dict.fromkeys(GROUND, GROUND),
}
HEAVY_FOR_NUMERICS = {"pandas", "yaml", "click", "pydantic", "rich", "matplotlib"}


def _room(path: Path) -> str:
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return parts[0]


def _imports(tree: ast.Module) -> list[str]:
    found: list[str] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            if node.module == "wentry_cli":
                found += [f"wentry_cli.{alias.name}" for alias in node.names]
            else:
                found.append(node.module)
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_file_keeps_the_house_rules(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    assert text.count("\n") <= 300, "a file has at most 300 lines"
    assert path.stem not in BANNED
    assert not BANNED & set(path.relative_to(PACKAGE).parts[:-1])
    problems = [*_import_problems(path, tree), *_function_problems(path, tree)]
    assert not problems, "\n".join(problems)


def _import_problems(path: Path, tree: ast.Module) -> list[str]:
    room = _room(path)
    allowed = ALLOWED[room] | {room, "__version__"}
    problems = []
    for name in _imports(tree):
        parts = name.split(".")
        if parts[0] == "wentry_cli" and len(parts) > 1 and parts[1] not in allowed:
            problems.append(f"{room} imports {name}: imports only go down")
        if room in NUMERICS and parts[0] in HEAVY_FOR_NUMERICS:
            problems.append(f"{room} imports {name}: numerics stay free of it")
    return problems


def _function_problems(path: Path, tree: ast.Module) -> list[str]:
    problems = []
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            doc = ast.get_docstring(node)
            length = (node.end_lineno or 0) - node.lineno + 1 - (len(doc.splitlines()) if doc else 0)
            if length > 60:
                problems.append(f"{node.name}: {length} lines")
            # a click command takes one parameter an option
            if _room(path) != "cli" and len(node.args.args) > 6 and not _is_compiled(node):
                problems.append(f"{node.name}: {len(node.args.args)} positional parameters")
    return problems


def _is_compiled(node: ast.FunctionDef) -> bool:
    """Compiled kernels take arrays one by one: numba has no keyword-only parameters."""
    return any(isinstance(mark, ast.Name) and mark.id == "compiled" for mark in node.decorator_list)


def test_every_room_is_known() -> None:
    assert {_room(path) for path in FILES} <= set(ALLOWED)


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys; sys.argv = ['wentry', '--help']\n"
        "from wentry_cli.cli import main\n"
        "try:\n    main.main()\nexcept SystemExit: pass\n"
        "heavy = {'numpy', 'pandas', 'scipy', 'cv2', 'numba', 'matplotlib', 'pydantic', 'rich', 'yaml'}\n"
        "heavy &= set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
