"""Executes the notebooks and writes each as a page of the book with its output: `make notebooks`.

Text stays text; a picture becomes an SVG file beside the page. The tests hold the pages against the notebooks.
"""

import os
import re
import sys
from pathlib import Path

import nbclient
import nbformat

# A plot is the same file in every run.
STYLE = """
import matplotlib
matplotlib.rcParams["svg.hashsalt"] = "misclosure"
%config InlineBackend.figure_formats = ["svg"]
"""
SVG = re.compile(r"<svg\b.*?</svg>", re.S)


def executed(path):
    """The notebook with its output."""
    os.environ["SOURCE_DATE_EPOCH"] = "0"
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    notebook.cells.insert(0, nbformat.v4.new_code_cell(STYLE))
    nbclient.NotebookClient(notebook, timeout=1800, kernel_name="python3").execute()
    notebook.cells.pop(0)
    return notebook


def parts(cell):
    """A code cell as parts of a page: its lines, and where it says something, its output as text."""
    said = []
    for out in cell.outputs:
        if out.output_type == "stream" and out.name == "stdout":
            said.append(out.text.rstrip())
        elif out.output_type == "execute_result":
            said.append(out.data["text/plain"].rstrip())
    lines = f"```python\n{cell.source}\n```"
    return [lines, "```text\n" + "\n".join(said) + "\n```"] if said else [lines]


def pictures(cell):
    """The pictures of a code cell, each as SVG text."""
    for out in cell.outputs:
        data = out.get("data", {})
        yield from SVG.findall(data.get("image/svg+xml") or data.get("text/html", ""))


def page(notebook, stem, folder):
    """Writes the page and its pictures."""
    text, number = [], 0
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            text.append(cell.source)
            continue
        text += parts(cell)
        for svg in pictures(cell):
            number += 1
            name = f"{stem}-{number}.svg"
            lines = (line.rstrip() for line in svg.splitlines())
            (folder / name).write_text("\n".join(lines) + "\n")
            title = re.search(r"<title>(.*?)</title>", svg)
            text.append(f"![{title[1] if title else 'plot'}]({name})")
    (folder / f"{stem}.md").write_text("\n\n".join(text) + "\n")


def main():
    folder = Path(sys.argv[1])
    folder.mkdir(exist_ok=True)
    for old in folder.glob("*.svg"):
        old.unlink()
    for path in sorted(Path(__file__).parent.glob("*.ipynb")):
        page(executed(path), path.stem, folder)
        print(folder / f"{path.stem}.md", flush=True)


if __name__ == "__main__":
    main()
