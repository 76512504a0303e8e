"""The examples of the book's chapter run, and its lists are those of the package."""

import re
from pathlib import Path

import pytest

import misclosure

PAGE = (Path(__file__).parents[2] / "docs" / "python.md").read_text()
EXAMPLES = re.findall(r"```python\n(.*?)```", PAGE, re.S)


def test_a_run_folder_is_read_with_pandas_and_polars(adjusted, tmp_path, monkeypatch, capsys):
    pytest.importorskip("polars", reason="polars is not installed: the lines that read a run folder are NOT tested")
    adjusted.save(tmp_path / "run")
    monkeypatch.chdir(tmp_path)
    lines = next(own for own in EXAMPLES if "run/summary.json" in own)
    assert len([line for line in lines.splitlines() if line and not line.startswith("import")]) <= 10
    exec(lines, {})
    assert repr(adjusted.sigma0) in capsys.readouterr().out


def test_three_lines_diagnose_a_block(shutter):
    lines = next(own for own in EXAMPLES if "found.verdict" in own)
    lines = lines.replace("misclosure.Block.from_pycolmap(reconstruction)", "given")
    names = {"given": shutter}
    exec(lines, names)
    assert names["found"].recommended == ["rolling-shutter"]


def test_every_column_of_the_page_is_there(shutter, adjusted):
    rows = re.findall(r"\| (`(?:block|run)\.\w+`.*?) \| (.*?) \|", PAGE)
    assert len(rows) == 8
    for names, columns in rows:
        for owner, name in re.findall(r"`(block|run)\.(\w+)`", names):
            table = getattr(shutter if owner == "block" else adjusted, name, None)
            if not isinstance(table, misclosure.Table):
                continue
            named = {word.strip() for word in re.sub(r"\(.*?\)", "", columns).split(",")}
            known = {word for word in named if re.fullmatch(r"[a-z]\w*", word)}
            assert known <= set(table.columns), (name, known)


def test_every_public_name_has_a_docstring():
    for name in misclosure.__all__:
        own = getattr(misclosure, name)
        if callable(own):
            assert own.__doc__, name
            members = {
                k: v for k, v in vars(own).items() if not k.startswith("_") and (callable(v) or isinstance(v, property))
            }
            assert all(getattr(v, "__doc__", None) for v in members.values()), (name, members)
