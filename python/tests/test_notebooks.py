"""The notebooks run from beginning to end; each ends in assertions."""

from pathlib import Path

import pytest

nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed: notebooks are NOT executed")
nbformat = pytest.importorskip("nbformat")

NOTEBOOKS = sorted((Path(__file__).parent.parent / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=[path.stem for path in NOTEBOOKS])
def test_a_notebook_runs(path, tmp_path, monkeypatch):
    if path.stem == "what-is-wrong":
        pytest.importorskip("pycolmap", reason="pycolmap is not installed: its notebook is NOT executed")
    # Two hundred blocks take minutes; the assertions hold with a part of them.
    monkeypatch.setenv("MISCLOSURE_BLOCKS", "50")
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    resources = {"metadata": {"path": str(tmp_path)}}
    done = nbclient.NotebookClient(notebook, timeout=600, kernel_name="python3", resources=resources).execute()
    assert all("error" not in (out["output_type"] for out in cell.get("outputs", [])) for cell in done.cells)
    shown = [out for cell in done.cells for out in cell.get("outputs", []) if out["output_type"] == "execute_result"]
    assert shown


def test_there_are_three():
    assert [path.stem for path in NOTEBOOKS] == ["how-sure", "study", "what-is-wrong"]
