"""Every function that docs/theory.md names is there, and every equation number is in its place."""

import ast
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wentry_cli.bench.solvers import SPHERES, table_1_sphere
from wentry_cli.mechanics.solver import find_period
from wentry_cli.report.theory import PERIOD_OF_TABLE_1, SLOPE_OF_TABLE_1

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


@pytest.mark.parametrize(
    ("heavier", "least", "greatest", "slope"), [(1.0, *PERIOD_OF_TABLE_1, SLOPE_OF_TABLE_1), (2.0, 1.17, 1.41, 1.23)]
)
def test_the_period_of_table_1(heavier, least, greatest, slope):
    """The numbers of the section on the period; half of both moduli in the equation of motion is twice its density."""
    scale, period = [], []
    for row in range(len(SPHERES)):
        sphere = table_1_sphere(row)
        slow = replace(sphere, density_kg_m3=heavier * sphere.density_kg_m3)
        for stretch_0 in np.linspace(1.05, 2.2, 24):
            scale.append(2.0 * sphere.radius_m * np.sqrt(sphere.density_kg_m3 / sphere.g_inf_pa))
            period.append(find_period(slow, stretch_0))
    ratio = np.divide(period, scale)
    assert [f"{number:.2f}" for number in (ratio.min(), ratio.max(), np.dot(scale, period) / np.dot(scale, scale))] == [
        f"{number:.2f}" for number in (least, greatest, slope)
    ]
    plain = re.sub(r"\s+", " ", TEXT)
    assert all(f"{number:.2f}".lstrip("0") in plain for number in (least, greatest, slope))
