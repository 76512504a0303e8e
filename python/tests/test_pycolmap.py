"""pycolmap in and out. Skipped, and said so, where pycolmap is not installed."""

import numpy as np
import pytest

import misclosure
from misclosure.errors import InputError

pycolmap = pytest.importorskip("pycolmap", reason="pycolmap is not installed: models in and out are NOT tested")


def scene(model="SIMPLE_RADIAL", params=None, points=300):
    """One of pycolmap's synthetic scenes: two cameras, twelve images."""
    options = pycolmap.SyntheticDatasetOptions()
    options.num_frames_per_rig = 6
    options.num_points3D = points
    options.camera_model_id = getattr(pycolmap.CameraModelId, model)
    if params is not None:
        options.camera_params = params
    pycolmap.set_random_seed(1)
    return pycolmap.synthesize_dataset(options)


CAMERAS = {
    "SIMPLE_PINHOLE": [1280.0, 512.0, 384.0],
    "PINHOLE": [1285.0, 1280.0, 512.0, 384.0],
    "SIMPLE_RADIAL": [1280.0, 512.0, 384.0, 0.05],
    "RADIAL": [1280.0, 512.0, 384.0, 0.05, -0.01],
    "OPENCV": [1280.0, 1280.0, 512.0, 384.0, 0.05, -0.01, 1e-3, -5e-4],
}


# Models with parameters that are zero keep them.
PLAIN = {"RADIAL": [1280.0, 512.0, 384.0, 0.0, 0.0], "OPENCV": [1280.0, 1280.0, 512.0, 384.0, 0.05, 0.0, 0.0, 0.0]}


def close(one, other):
    np.testing.assert_allclose(np.asarray(one), np.asarray(other), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("model, params", [*CAMERAS.items(), *PLAIN.items()])
def test_a_model_comes_back(model, params):
    before, after = scene(model, params), scene(model, params)
    block = misclosure.Block.from_pycolmap(before)
    # Everything that is to be put back is spoiled first.
    for point in after.points3D.values():
        point.xyz = (0.0, 0.0, 0.0)
    for image in after.images.values():
        image.frame.set_cam_from_world(image.camera_id, pycolmap.Rigid3d())
    for camera in after.cameras.values():
        camera.params = [1.0] * len(camera.params)
    assert block.to_pycolmap(after) is after
    for key, image in before.images.items():
        close(after.images[key].cam_from_world().matrix(), image.cam_from_world().matrix())
    for key, point in before.points3D.items():
        close(after.points3D[key].xyz, point.xyz)
    for key, camera in before.cameras.items():
        assert after.cameras[key].model == camera.model
        close(after.cameras[key].params, camera.params)


def test_a_new_model_has_everything():
    before = scene()
    made = misclosure.Block.from_pycolmap(before).to_pycolmap()
    by_name = {image.name: image for image in made.images.values()}
    assert made.num_points3D() == before.num_points3D()
    for image in before.images.values():
        own = by_name[image.name]
        close(own.cam_from_world().matrix(), image.cam_from_world().matrix())
        seen = {p.point3D_id: p.xy for p in image.points2D if p.has_point3D()}
        written = {p.point3D_id: p.xy for p in own.points2D if p.has_point3D()}
        assert seen.keys() == written.keys()
        close([written[key] for key in sorted(seen)], [seen[key] for key in sorted(seen)])


def test_tables_are_those_of_the_model():
    model = scene()
    block = misclosure.Block.from_pycolmap(model, name="scene", tie_px=0.7)
    assert block.name == "scene" and block.sigma["tie_px"] == 0.7
    assert block.images["image"].tolist() == sorted(image.name for image in model.images.values())
    assert block.points["point"].tolist() == [str(key) for key in sorted(model.points3D)]
    assert len(block.ties) == sum(point.track.length() for point in model.points3D.values())
    assert any("0.5 px" in note for note in misclosure.Block.from_pycolmap(model).notes)


def test_an_adjusted_model_goes_back():
    model = scene()
    block = misclosure.Block.from_pycolmap(model)
    run = block.adjust(free="f,radial", fix="k2,k3", tie="dc=pp")
    run.to_pycolmap(model)
    camera = model.cameras[int(run.cameras["camera"][0])]
    close(camera.params[0], run.cameras["f"][0])
    points = run.points
    close([model.points3D[int(name)].xyz for name in points["point"]], np.stack([points[c] for c in "xyz"], 1))
    # The scene is free of errors, and the adjustment found it so.
    assert run.tie_rms_px < 1e-6 and model.compute_mean_reprojection_error() < 1e-5


def test_what_is_no_model_is_named():
    with pytest.raises(InputError, match="reconstruction: expected a pycolmap.Reconstruction, found int"):
        misclosure.Block.from_pycolmap(3)
    with pytest.raises(InputError, match="tie_px=-1"):
        misclosure.Block.from_pycolmap(scene(), tie_px=-1)
    other = misclosure.Block.simulate("closerange", points=60)
    with pytest.raises(InputError, match="reconstruction: it has no camera 'cam'"):
        other.to_pycolmap(scene())
    with pytest.raises(InputError, match="the model has no image"):
        misclosure.Block.from_pycolmap(pycolmap.Reconstruction())
