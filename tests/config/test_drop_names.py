"""Names of drops, made of the folders that hold them."""

from __future__ import annotations

from pathlib import Path

import pytest

from wentry_cli.config.campaign import find_drops
from wentry_cli.errors import InputError


def test_a_name_that_no_folder_can_have_is_refused(tmp_path: Path) -> None:
    deep = tmp_path / ("n" * 200) / ("m" * 60)
    deep.mkdir(parents=True)
    (deep / "experiment.yaml").write_text("kind: free_flight\n")
    with pytest.raises(InputError, match="at most 255 bytes, not 262"):
        find_drops(tmp_path)
    assert list(find_drops(deep.parent)) == ["m" * 60]
