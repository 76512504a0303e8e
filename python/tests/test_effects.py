"""Effects of formulas. Those that compile need a C++ compiler and Ceres' headers."""

import os
import shutil

import pytest

import misclosure
from misclosure.errors import CompilerError, InputError

RIPPLE = dict(
    stage="image",
    dx="a*sin(2*pi*x/p)",
    dy="0",
    parameters={"a": {"unit": "px", "typical": 0.2, "most": 2.0}, "p": {"unit": "px", "given": 250}},
)
BUILDS = shutil.which("c++") and os.path.exists("/usr/include/ceres/jet.h")
needs_compiler = pytest.mark.skipif(not BUILDS, reason="no C++ compiler with Ceres' headers: formulas are NOT compiled")


@pytest.fixture(scope="module")
def ripple():
    return misclosure.effect("ripple", **RIPPLE)


@needs_compiler
def test_an_effect_is_found_in_a_block_that_has_it(ripple):
    assert ripple.id == "ripple" and ripple.stage == "image" and ripple.checked["holds"]
    truth = misclosure.Block.simulate("closerange", points=400, seed=1)
    block = truth.inject([(ripple, {"a": 0.3}), "noise:px=0.2"])
    run = block.adjust(add=ripple)
    found = run.effects[0]
    assert found.parameter == "a" and abs(found.value - 0.3) < 5 * found.sigma < 0.1
    assert block.improve(plugins=ripple).recommended == ["ripple"]


@needs_compiler
def test_the_command_writes_the_same_header(ripple, program, tmp_path):
    program(
        "effects",
        "new",
        "ripple",
        "--stage",
        "image",
        "-o",
        tmp_path,
        "--formula",
        "dx=a*sin(2*pi*x/p)",
        "--formula",
        "dy=0",
        "--parameter",
        "a:unit=px,typical=0.2,most=2",
        "--parameter",
        "p:unit=px,given=250",
    )
    assert (tmp_path / "ripple.h").read_text() == ripple.header
    program("effects", "build", tmp_path / "ripple.h", "-o", tmp_path / "ripple.so")
    assert "null law" in program("effects", "check", tmp_path / "ripple.so").stdout


@needs_compiler
@pytest.mark.parametrize(
    "stage, formula",
    [
        ("interior", dict(df="a*t/60")),
        ("exposure", dict(dX="a*vx", dY="a*vy")),
        ("ray", dict(dZ="a*((X-CX)^2+(Y-CY)^2)")),
        ("position", dict(dZ="a")),
        ("control", dict(dZ="a")),
        ("frame", dict(dZ="a*X")),
    ],
)
def test_every_stage_has_formulas_that_keep_the_laws(stage, formula):
    made = misclosure.effect("own", stage=stage, parameters={"a": {"unit": "m", "typical": 0.01}}, **formula)
    assert made.stage == stage and made.checked["holds"]


def test_no_compiler_is_said(monkeypatch):
    monkeypatch.setenv("CXX", "no-such-compiler")
    with pytest.raises(CompilerError, match="`no-such-compiler` cannot be run: .* a C\\+\\+ compiler is needed"):
        misclosure.effect("ripple", **RIPPLE)


@pytest.mark.parametrize(
    "changed, text",
    [
        (dict(dx="a*q"), "dx = `a\\*q`, character 3: `q` is not known at the image stage; there are x, y"),
        (dict(dx="a*("), "dx = `a\\*\\(`, character 4: expected a number, a name or `\\(`, found the end"),
        (dict(dz="a"), "`dz`: the image stage has dx, dy"),
        (dict(stage="lens"), 'stage="lens": expected one of'),
        (dict(parameters={"a": {"size": 1}}), "parameters, a: 'size' is unknown"),
        (dict(parameters={"a": "x"}), "parameters, a: typical='x': expected a number"),
        (dict(parameters=3), "parameters=3: expected a dict"),
        (dict(dx=None), "dx=None: expected an expression"),
    ],
)
def test_what_is_wrong_in_a_formula_is_named(changed, text):
    with pytest.raises(InputError, match=text):
        misclosure.effect("ripple", **{**RIPPLE, **changed})


def test_names_that_no_effect_can_have():
    for name in ("Ripple", "a b", "rolling-shutter", "../x", ""):
        with pytest.raises(InputError, match="is no name of an effect|is an effect that is built in"):
            misclosure.effect(name, **RIPPLE)
