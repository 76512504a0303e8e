"""The package gives what the program gives, to the last bit."""

import csv
import json

import numpy as np
import pytest

import misclosure
from alike import same, same_table


@pytest.fixture(scope="module")
def folder(shutter, tmp_path_factory):
    """The block as files."""
    folder = tmp_path_factory.mktemp("same") / "block"
    shutter.write(folder)
    return folder


def without_seconds(summary):
    """How long it took differs from call to call. So does what Ceres' threads sum up in no fixed order."""
    native = {"native": {k: v for k, v in summary["solvers"]["native"].items() if k != "seconds"}}
    return {**summary, "solvers": native, "agreement": None}


def columns(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: [row[name] for row in rows] for name in rows[0]}


def as_written(table, written, names):
    for name in names:
        own = [float(cell) if cell else float("nan") for cell in written[name]]
        np.testing.assert_array_equal(np.asarray(table[name], float), own, err_msg=name)


def test_plan(folder, program):
    told = json.loads(program("plan", folder, "--json", "--free", "f,pp", "--significance", "0.01").stdout)
    planned = misclosure.Block.read(folder).plan(free=["f", "pp"], significance=0.01)
    assert planned.json == told
    sizes = planned.sizes.to_pandas().set_index("effect")
    assert sizes.loc["rolling-shutter", "size"] > 0 and planned.precision.height_m["worst"] > 0
    assert {own.effect for own in planned.effects}.isdisjoint(own.effect for own in planned.hidden)


def test_adjustment(folder, tmp_path, program):
    words = ["--datum", "all", "--add", "rolling-shutter", "--fix", "k3"]
    told = json.loads(program("adjust", folder, "-o", tmp_path / "run", "--json", *words).stdout)
    run = misclosure.Block.read(folder).adjust(datum="all", add="rolling-shutter", fix="k3")
    assert without_seconds(run.summary) == without_seconds(told)
    residuals = columns(tmp_path / "run" / "residuals.csv")
    as_written(run.residuals, residuals, ["x", "y", "rx", "ry", "sigma"])
    images = run.images["image"]
    assert images[run.residuals["image"]].tolist() == residuals["image"]
    as_written(
        run.images, columns(tmp_path / "run" / "images.csv"), ["x", "y", "z", "qw", "qx", "qy", "qz", "sigma_cz"]
    )
    points = columns(tmp_path / "run" / "points.csv")
    assert run.points["point"].tolist() == points["point"]
    as_written(run.points, points, ["x", "y", "z", "sigma_x", "sigma_y", "sigma_z", "gsd_m", "correlation_xy"])
    as_written(run.checks, columns(tmp_path / "run" / "checks.csv"), ["dx", "dy", "dz", "sigma_dz", "rms_px"])
    as_written(run.gnss, columns(tmp_path / "run" / "gnss.csv"), ["dx", "dy", "dz", "heading_deg"])
    covariance = columns(tmp_path / "run" / "parameter_covariance.csv")
    full = run.covariance()
    assert full.matrix[0, 0] == float(covariance["covariance"][0])
    assert run.model == (tmp_path / "run" / "model.toml").read_text()


def test_diagnosis(folder, tmp_path, program):
    told = json.loads(program("improve", folder, "-o", tmp_path / "run", "--json").stdout)
    found = misclosure.Block.read(folder).improve()
    # Whether the solvers agree is known to the last digit alone by the one that sums in order.
    assert found.json == told
    assert found.verdict == "missing" and found.recommended == ["rolling-shutter"]
    found.save(tmp_path / "saved")
    written, own = (sorted(p.name for p in (tmp_path / name).iterdir()) for name in ("run", "saved"))
    assert written == own
    for name in ("points.csv", "residuals.csv", "diagnosis.json", "model.toml", "figures/sensor-final-1.svg"):
        assert (tmp_path / "run" / name).read_bytes() == (tmp_path / "saved" / name).read_bytes(), name


def test_block_in_memory_is_the_block_in_files(shutter, folder):
    read = misclosure.Block.read(folder)
    same(read, shutter)
    run, other = shutter.adjust(datum="control"), read.adjust(datum="control")
    assert without_seconds(run.summary) == without_seconds(other.summary)


def test_simulation(tmp_path, program):
    words = ["--set", "points=300", "--seed", "5", "--noise-px", "0.4", "--noise-survey", "--start-angle", "0.5"]
    program("simulate", "corridor", "-o", tmp_path / "block", *words)
    read = misclosure.Block.read(tmp_path / "block")
    made = misclosure.Block.simulate("corridor", points=300, seed=5, noise_px=0.4, noise_survey=True, start_angle=0.5)
    same(read, made)


def test_mistakes(truth, tmp_path, program):
    block = truth.inject("noise", px=0.3, mistakes="scale:of=control,unit=feet")
    block.write(tmp_path / "feet")
    told = json.loads(program("check", tmp_path / "feet", "--json").stdout)
    checked = block.check()
    assert checked.mistakes.to_dicts() == told["mistakes"] and len(checked.mistakes) == 1
    program("mend", tmp_path / "feet", "-o", tmp_path / "mended")
    mended = block.mend()
    assert [own.kind for own in mended.mended] == [own.kind for own in checked.mistakes]
    by_program = misclosure.Block.read(tmp_path / "mended")
    same_table(mended.block.control, by_program.control)


def test_errors_have_the_programs_text(tmp_path, program):
    said = program("adjust", tmp_path / "none", "-o", tmp_path / "run", code=2).stderr
    with pytest.raises(misclosure.errors.BlockError) as raised:
        misclosure.Block.read(tmp_path / "none")
    assert said == f"error: {raised.value}\n" and raised.value.code == 2


def test_models_that_do_not_fit_have_the_programs_text(tmp_path, program, truth):
    block = truth.inject("noise", px=0.3)
    block.write(tmp_path / "block")
    words = ["--solver", "native", "--datum", "control", "--add", "gnss-shift"]
    said = program("adjust", tmp_path / "block", "-o", tmp_path / "run", *words, code=2).stderr
    with pytest.raises(misclosure.errors.ModelError) as raised:
        misclosure.Block.read(tmp_path / "block").adjust(solver="native", datum="control", add="gnss-shift")
    assert said.splitlines()[-1] == f"error: {raised.value}"
