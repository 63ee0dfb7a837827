"""Every function that docs/theory.md names is there, and every equation number is in its place."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
TEXT = (ROOT / "docs" / "theory.md").read_text(encoding="utf-8")


def test_named_functions_exist():
    references = re.findall(r"`([a-z_/]+\.py):([A-Za-z_]+)`", TEXT)
    assert len(references) > 30
    for path, name in references:
        tree = ast.parse((ROOT / "wentry_cli" / path).read_text(encoding="utf-8"))
        defined = {node.name for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)}
        assert name in defined, f"{path} has no {name}"


def test_equations_are_numbered_in_order():
    numbers = [int(number) for number in re.findall(r"^\*\*\((\d+)\)\*\*", TEXT, flags=re.MULTILINE)]
    assert numbers == list(range(1, len(numbers) + 1))
    cited = {int(number) for number in re.findall(r"(?<!\w)\((\d{1,2})\)", TEXT)}
    assert cited <= set(numbers)


def test_every_equation_names_its_function():
    body = TEXT.split("## The period")[0]
    blocks = re.split(r"^\*\*\((\d+)\)\*\*", body, flags=re.MULTILINE)
    assert len(blocks) > 50
    silent = [number for number, text in zip(blocks[1::2], blocks[2::2], strict=True) if ".py:" not in text]
    assert silent == []


def test_all_misprints_are_listed():
    rows = re.findall(r"^\| (\d+) \|", TEXT, flags=re.MULTILINE)
    assert [int(row) for row in rows] == list(range(1, 18))
