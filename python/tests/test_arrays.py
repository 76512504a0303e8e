"""Blocks from arrays: what comes in comes out, and what is wrong is named and never crashes."""

import math
import pickle

import numpy as np
import pandas
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import misclosure
from alike import TABLES, same
from misclosure.errors import InputError


def tables(block):
    return {name: getattr(block, name) for name in TABLES}


@pytest.fixture(scope="module")
def block():
    return misclosure.Block.simulate("closerange", points=60, seed=4)


def build(block, **changed):
    arguments = {**tables(block), "sigma": block.sigma, "name": block.name, "crs": block.crs, **changed}
    return misclosure.Block.from_arrays(**arguments)


def test_tables_come_back_to_the_last_bit(block, shutter):
    for own in (block, shutter):
        again = build(own)
        same(again, own)
        assert again.sigma == own.sigma and again.name == own.name
    assert build(shutter).adjust(datum="all").summary["cameras"] == shutter.adjust(datum="all").summary["cameras"]


def test_every_container_is_taken(block):
    frames = block.to_pandas()
    dicts = {
        name: {column: list(table[column].tolist()) for column in table.columns}
        for name, table in tables(block).items()
    }
    records = {name: frame.to_dict("records") for name, frame in frames.items()}
    for given_ in (frames, dicts, records):
        same(build(block, **given_), block)


def test_names_and_positions_mean_the_same(block):
    frame = block.ties.to_pandas()
    assert frame["image"].tolist() == block.images["image"][block.ties["image"]].tolist()
    same(build(block, ties=frame), block)


def test_labels_of_any_size_name_points(block):
    labels = block.ties["point"].astype(np.int64) * 1_000_003 + 7
    ties = {**{name: block.ties[name] for name in ("image", "x", "y")}, "point": labels}
    made = build(block, ties=ties, points=None)
    assert made.points["point"].tolist() == [str(label) for label in np.unique(labels)]
    np.testing.assert_array_equal(made.ties["x"], block.ties["x"])


def test_tables_are_read_only_copies(block):
    ties = block.ties
    with pytest.raises(ValueError, match="read-only"):
        ties["x"][0] = 1.0
    copy = ties.copy()
    copy["x"][0] = 1.0
    assert block.ties["x"][0] != 1.0
    assert pickle.loads(pickle.dumps(ties)).to_pandas().equals(ties.to_pandas())


def test_what_serves_nothing_is_left_out_and_counted(block):
    cameras = pandas.concat([block.cameras.to_pandas(), block.cameras.to_pandas().assign(camera="spare")])
    ties = block.ties.to_pandas().astype({"point": str, "image": str})
    ties.loc[len(ties)] = [ties["image"][0], "alone", 10.0, 10.0, float("nan")]
    made = build(block, cameras=cameras, ties=ties)
    counted = made.contents["set_aside"]
    assert (counted["unused_cameras"], counted["one_ray_points"]) == (1, 1)
    same(made, block)


WRONG = [
    ("ties", "x", 3, float("nan"), "ties, row 3, column x: expected a finite number, found NaN"),
    ("ties", "x", 3, 1e9, "ties, row 3, column x: 1000000000 is outside the sensor"),
    ("ties", "sigma", 2, -1.0, "ties, row 2, column sigma: expected a number above zero or NaN, found -1"),
    ("ties", "image", 1, 99999, "ties, row 1, column image: 99999 is no row of images: expected 0 to"),
    ("images", "qw", 5, 7.0, "images, row 5, column qw, qx, qy, qz: expected a quaternion of length 1"),
    ("images", "x", 0, float("inf"), "images, row 0, column x: expected a finite number, found inf"),
    ("images", "camera", 4, "no", "images, row 4, column camera: 'no' is not in cameras, which has 'cam'"),
    ("images", "image", 6, "", "images, row 6, column image: expected a name without blanks"),
    ("cameras", "f", 0, 0.0, "cameras, row 0, column f: expected a number above zero, found 0"),
    ("control", "role", 0, "chek", 'control, row 0, column role: expected "control" or "check", found "chek"'),
    ("control", "sigma_z", 0, 0.0, "control, row 0, column sigma_z: expected a number above zero or NaN, found 0"),
    ("marks", "point", 2, -1, "marks, row 2, column point: -1 is no row of control: expected 0 to"),
]


@pytest.mark.parametrize("argument, column, row, value, text", WRONG, ids=[w[4][:40] for w in WRONG])
def test_a_wrong_value_is_named(block, argument, column, row, value, text):
    table = tables(block)[argument]
    columns = {name: table[name].tolist() for name in table.columns}
    columns[column][row] = value
    with pytest.raises(InputError) as raised:
        build(block, **{argument: columns})
    assert str(raised.value).startswith(text), raised.value


def test_names_that_stand_twice_and_measurements_that_repeat(block):
    images = {name: block.images[name].tolist() for name in block.images.columns}
    images["image"][3] = images["image"][1]
    with pytest.raises(InputError, match="images, row 3, column image: .* stands twice, first in row 1"):
        build(block, images=images)
    ties = np.concatenate([np.asarray(block.ties), np.asarray(block.ties)[:1]])
    with pytest.raises(
        InputError, match=f"ties, row {len(ties) - 1}, column image, point: .* first in row 0; keep one"
    ):
        build(block, ties=ties)


SHAPES = [
    (dict(ties=np.zeros((3, 4))), "ties: expected named columns, found an array of dtype float64 and shape"),
    (dict(ties={"image": [0], "point": [0, 1], "x": [1.0], "y": [1.0]}), "ties: expected columns of one length"),
    (dict(ties={"image": [0], "point": [0], "x": [[1.0]], "y": [1.0]}), "ties, column x: expected shape"),
    (dict(ties={"image": [0], "point": [0], "x": ["a"], "y": [1.0]}), "ties, column x: expected numbers, found dtype"),
    (dict(ties={"image": [0], "point": [0], "x": [1j], "y": [1.0]}), "ties, row 0, column x: expected a number"),
    (dict(ties={"image": [0], "point": [0], "u": [1.0]}), "ties, column u: no such column; there are image, point"),
    (dict(ties={"image": [0], "point": [0], "x": [1.0]}), "ties, column y: the column is missing"),
    (dict(ties=7), "ties: expected a structured array, a DataFrame, a dict of columns or a list of dicts, found int"),
    (dict(ties=[3]), "ties, row 0: expected a dict"),
    (dict(cameras=None), "cameras: expected one at least"),
    (dict(images=[]), "images: expected one at least"),
    (dict(sigma={"tie": 1.0}), "sigma: 'tie' is unknown"),
    (dict(sigma={"tie_px": float("nan")}), "sigma: tie_px = nan: expected a number above zero"),
    (dict(sigma=None), "images, row 0, column gnss_sigma_xy|ties, row 0, column sigma: no standard deviation"),
    (dict(name=3), "name: expected a text"),
    (dict(ties=None, marks=None, control=None), "ties: no tie point is measured in two images"),
    (dict(ties=None, control=None), "marks, row 0, column point: 0 is no row of control, which is empty"),
]


@pytest.mark.parametrize("changed, text", SHAPES, ids=[text[:40] for _, text in SHAPES])
def test_a_wrong_shape_is_named(block, changed, text):
    with pytest.raises(InputError, match=text):
        build(block, **changed)


ODD = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=5),
    st.binary(max_size=3),
    st.sampled_from([1j, np.float32(3), np.int8(-1), np.datetime64("2020-01-01"), [], {}, "\ud800", "\0", 2**64]),
)


@st.composite
def malformed(draw):
    """One argument of a sound block with one to three things done to it."""
    argument = draw(st.sampled_from(["images", "cameras", "points", "ties", "control", "marks"]))
    return argument, draw(
        st.lists(st.tuples(st.sampled_from("vcdltrk"), st.integers(0, 30), ODD), min_size=1, max_size=3)
    )


def spoil(columns, how, k, value):
    names = list(columns)
    name = names[k % len(names)]
    column = columns[name]
    if how == "v" and len(column):
        columns[name] = list(column)
        columns[name][k % len(column)] = value
    elif how == "c":
        columns[name] = value
    elif how == "d":
        del columns[name]
    elif how == "l":
        columns[name] = list(column) + [value]
    elif how == "t":
        columns[name] = np.array([value] * len(column), dtype=object)
    elif how == "r":
        columns[str(value)] = column
    elif how == "k":
        columns[name] = np.asarray(column)[::-1]


@settings(max_examples=10_000, deadline=None, suppress_health_check=list(HealthCheck))
@given(spoiled=malformed())
def test_malformed_arguments_never_crash(spoiled):
    argument, deeds = spoiled
    columns = {name: list(values) for name, values in SOUND[argument].items()}
    for how, k, value in deeds:
        try:
            if columns:
                spoil(columns, how, k, value)
        except (TypeError, ValueError, OverflowError, IndexError):
            return
    try:
        made = misclosure.Block.from_arrays(**{**SOUND, argument: columns}, sigma=SIGMA)
    except InputError as refused:
        assert str(refused).split(",")[0].split(":")[0] in (*SOUND, "sigma"), refused
    else:
        # What is taken is a sound block: every number that is read is one.
        assert all(math.isfinite(value) for value in made.ties["x"].tolist() + made.images["qw"].tolist())


def tiny():
    """Three images of one camera and a handful of points: small enough to be built ten thousand times."""
    images = {
        **{"image": ["a", "b", "c"], "camera": ["cam"] * 3, "flight": ["one"] * 3, "time_s": [0.0, 1.0, 2.0]},
        **{"x": [0.0, 5.0, 10.0], "y": [0.0] * 3, "z": [50.0] * 3},
        **{"qw": [0.0] * 3, "qx": [1.0] * 3, "qy": [0.0] * 3, "qz": [0.0] * 3},
        **{f"gnss_{axis}": [own, own + 5.0, float("nan")] for axis, own in zip("xyz", (0.0, 1.0, 50.0))},
    }
    cameras = {"camera": ["cam"], "width_px": [4000], "height_px": [3000], "f": [3600.0], "k1": [1e-9]}
    points = {"point": ["p", "q"], "x": [0.0, 1.0], "y": [0.0, 1.0], "z": [0.0, 0.0]}
    rows = [(image, point) for image in range(3) for point in range(2)]
    ties = {
        "image": [i for i, _ in rows],
        "point": [p for _, p in rows],
        "x": [2000.0 + 10 * i for i, _ in rows],
        "y": [1500.0 + 9 * p for _, p in rows],
    }
    control = {"point": ["g", "h"], "x": [0.0, 3.0], "y": [1.0, 2.0], "z": [0.0, 0.1], "role": ["control", "check"]}
    marks = {"image": ["a", "b", "a", "c"], "point": ["g", "g", "h", "h"], "x": [100.0] * 4, "y": [200.0] * 4}
    return {"images": images, "cameras": cameras, "points": points, "ties": ties, "control": control, "marks": marks}


SOUND = tiny()
SIGMA = {"tie_px": 0.5, "mark_px": 0.5, "control_xy_m": 0.01, "control_z_m": 0.01, "gnss_xy_m": 0.05, "gnss_z_m": 0.05}


def test_the_sound_block_is_sound():
    made = misclosure.Block.from_arrays(**SOUND, sigma=SIGMA)
    assert (len(made.images), len(made.ties), len(made.marks)) == (3, 6, 4)


@settings(max_examples=300, deadline=None)
@given(
    text=st.text(max_size=30), name=st.sampled_from(["add", "free", "fix", "datum", "loss", "tie", "model", "plugins"])
)
def test_malformed_options_never_crash(text, name):
    try:
        misclosure.Block.from_arrays(**SOUND, sigma=SIGMA).adjust(**{name: text})
    except misclosure.MisclosureError:
        pass
