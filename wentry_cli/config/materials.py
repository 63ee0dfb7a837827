"""Materials: the user's ``materials.yaml`` (find_materials), else the packaged Table 1, else a calibration."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from wentry_cli.config.messages import validate
from wentry_cli.config.models import Part
from wentry_cli.config.places import Document, read_document
from wentry_cli.config.values import Label, Positive, Uncertainty
from wentry_cli.errors import ConfigurationError
from wentry_cli.tables import has_table, read_table

RIGID = "rigid"


class Material(Part):
    """Parameters of the Bergström–Boyce sphere.

    ``g_inf_text_pa``, ``radius_m``, ``density_kg_m3`` and ``source`` are kept for the record: a drop uses its own size
    and density. The uncertainties of the flow rule are shown in the report.
    """

    g_inf_pa: Positive
    g_inf_pa_unc: Uncertainty = 0.0
    g_inf_text_pa: Positive | None = None
    g_t_pa: Annotated[float, Field(strict=True, ge=0, allow_inf_nan=False)]
    xi: Annotated[float, Field(strict=True, ge=0, allow_inf_nan=False)] = 0.0866
    tau0_pa: Positive = 1.0
    m: Annotated[float, Field(strict=True, gt=0, le=1000, allow_inf_nan=False)] = 1.0
    n: Annotated[float, Field(strict=True, ge=-10, le=10, allow_inf_nan=False)]
    n_unc: Uncertainty = 0.0
    eps0_dot_1_s: Annotated[float, Field(strict=True, ge=0, le=1e12, allow_inf_nan=False)]
    eps0_dot_1_s_unc: Uncertainty = 0.0
    radius_m: Positive | None = None
    density_kg_m3: Positive | None = None
    source: Label | None = None


class MaterialsFile(Part):
    """The content of a ``materials.yaml``."""

    materials: dict[str, Material]


def packaged_config(name: str) -> Path:
    """A file of ``configs/``: inside the installed package, or at the top of a checkout."""
    package = Path(__file__).resolve().parent.parent
    inside = package / "configs" / name
    return inside if inside.is_file() else package.parent / "configs" / name


def read_materials(path: Path) -> dict[str, Material]:
    """Every material of a ``materials.yaml``; raises ``ConfigurationError`` with file, line and column."""
    return validate(MaterialsFile, _only_materials(read_document(path))).materials


def _only_materials(document: Document) -> Document:
    """``rigid`` may be listed for the reader's sake; it has no parameters."""
    listed = document.data.get("materials")
    if not isinstance(listed, dict):
        return document
    soft = {key: value for key, value in listed.items() if key != RIGID}
    return Document({**document.data, "materials": soft}, document.places)


def find_material(key: str | None, path: Path, own: Path | None = None) -> Material | None:
    """The material ``key`` of ``path``; ``None`` for a rigid sphere or where no material was named.

    ``own`` is where a file of the user's would be found, where ``path`` is not one.
    """
    if key is None or key == RIGID:
        return None
    known = read_materials(path)
    if key not in known:
        near = difflib.get_close_matches(key, [*known, RIGID], n=1)
        hint = f"did you mean {near[0]}?" if near else f"known: {', '.join([*known, RIGID])}"
        file = path if own is None else f"the packaged {path.name}"
        mend = "" if own is None else f"; write a material of your own into {own}"
        raise ConfigurationError(f"sphere.material: {key} does not stand in {file}; {hint}{mend}")
    return known[key]


def calibrated(material: Material | None, key: str | None, sphere_id: str, results: Path) -> Material | None:
    """The material with what ``materials.csv`` in ``results`` knows better; a row of the same sphere wins."""
    if key is None or key == RIGID or not has_table(results, "materials"):
        return material
    rows = read_table(results, "materials")
    rows = rows[(rows["material"] == key) & (rows["status"] == "ok")]
    own = rows[rows["sphere_id"] == sphere_id]
    rows = own if len(own) else rows
    given: dict[str, Any] = {} if material is None else material.model_dump()
    for _, row in rows.iterrows():
        fields = [name for name in Material.model_fields if name in row.index]
        given |= {name: float(row[name]) for name in fields if name != "source" and row[name] == row[name]}
        given["source"] = f"materials.csv ({row['source']})"
    complete = all(field in given for field, info in Material.model_fields.items() if info.is_required())
    return Material.model_validate(given) if complete else material
