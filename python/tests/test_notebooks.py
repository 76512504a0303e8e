"""The notebooks run from beginning to end, each ends in assertions, and the book's pages are what they say."""

import sys
from pathlib import Path

import pytest

nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed: notebooks are NOT executed")
nbformat = pytest.importorskip("nbformat")

FOLDER = Path(__file__).parent.parent / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
PAGES = Path(__file__).parents[2] / "docs" / "notebooks"
sys.path.insert(0, str(FOLDER))
import pages  # noqa: E402

# What these say depends on how many blocks are made, and on pycolmap's own random numbers.
VARIES = {"how-sure", "what-is-wrong"}


@pytest.mark.parametrize("path", NOTEBOOKS, ids=[path.stem for path in NOTEBOOKS])
def test_a_notebook_runs_and_says_what_its_page_shows(path, tmp_path, monkeypatch):
    if path.stem == "what-is-wrong":
        pytest.importorskip("pycolmap", reason="pycolmap is not installed: its notebook is NOT executed")
    # Two hundred blocks take minutes; the assertions hold with a part of them.
    monkeypatch.setenv("MISCLOSURE_BLOCKS", "50")
    monkeypatch.chdir(tmp_path)
    done = pages.executed(path)
    nbformat.validate(done)
    outputs = [out for cell in done.cells for out in cell.get("outputs", [])]
    assert all(out["output_type"] != "error" for out in outputs)
    assert any(out["output_type"] == "execute_result" for out in outputs)
    page = (PAGES / f"{path.stem}.md").read_text()
    place = 0
    for cell in done.cells:
        parts = [cell.source] if cell.cell_type == "markdown" else pages.parts(cell)[: 1 if path.stem in VARIES else 2]
        for part in parts:
            assert part in page[place:], f"run `make notebooks`; {path.stem}.md does not show:\n{part}"
            place = page.index(part, place)


def test_there_are_three():
    assert [path.stem for path in NOTEBOOKS] == ["how-sure", "study", "what-is-wrong"]
