"""pycolmap: models in and out, by the program's own reader and writer of COLMAP's binary files.

Both keep every bit of poses, points and measurements; cameras are converted exactly where the models are the same.
"""

from __future__ import annotations

import os
import tempfile
from typing import TYPE_CHECKING, Any, Optional

from . import _native
from .errors import InputError

if TYPE_CHECKING:
    from .block import Block


def from_pycolmap(
    reconstruction: Any, name: Optional[str], tie_px: Optional[float], approximate: bool
) -> _native.Block:
    """The block of a model (see `Block.from_pycolmap`)."""
    if not (hasattr(reconstruction, "write_binary") and hasattr(reconstruction, "points3D")):
        problem = f"expected a pycolmap.Reconstruction, found {type(reconstruction).__name__}"
        raise InputError(f"reconstruction: {problem}", 2)
    if tie_px is not None and not (isinstance(tie_px, (int, float)) and 0 < tie_px < float("inf")):
        raise InputError(f"tie_px={tie_px!r}: expected a number above zero (px)", 2)
    if name is not None and not isinstance(name, str):
        raise InputError(f"name={name!r}: expected a text", 2)
    with tempfile.TemporaryDirectory() as folder:
        reconstruction.write_binary(folder)
        return _native.Block.import_("colmap", folder, name or "colmap", tie_px, bool(approximate))


def to_pycolmap(block: Block, reconstruction: Any) -> Any:
    """A model of the block, or the given one with the block's cameras, poses and points."""
    import pycolmap

    with tempfile.TemporaryDirectory() as folder:
        # A model that has points and measurements gets cameras and poses from the files, and points from memory.
        block._native.export("colmap", folder, reconstruction is not None)
        made = pycolmap.Reconstruction(os.fspath(folder))
    if reconstruction is None:
        return made
    _put_cameras(block, made, reconstruction)
    _put_poses(block, made, reconstruction)
    _put_points(block, reconstruction)
    reconstruction.update_point_3d_errors()
    return reconstruction


def _put_cameras(block: Block, made: Any, reconstruction: Any) -> None:
    # The writer numbers cameras from 1; their names are the ids of the model that they came from.
    for number, name in enumerate(block.cameras["camera"].tolist(), 1):
        own = made.cameras[number]
        if not name.isdigit() or int(name) not in reconstruction.cameras:
            raise InputError(
                f"reconstruction: it has no camera {name!r}; expected the model that the block came from", 2
            )
        camera = reconstruction.cameras[int(name)]
        if (camera.width, camera.height) != (own.width, own.height):
            problem = f"camera {name} has {camera.width} x {camera.height} px, the block's {own.width} x {own.height}"
            raise InputError(f"reconstruction: {problem}", 2)
        kept = _in_model_of(camera, own)
        if kept is None:
            camera.model, camera.params = own.model, own.params
        else:
            camera.params = kept


def _named(camera: Any) -> dict[str, float]:
    """Parameters by name; one focal length stands for both."""
    names = [name.strip() for name in camera.params_info.split(",")]
    values = dict(zip(names, camera.params))
    both = values.pop("f", None)
    if both is not None:
        values["fx"] = values["fy"] = both
    if "k" in values:
        values["k1"] = values.pop("k")
    return values


def _in_model_of(camera: Any, own: Any) -> Optional[list[float]]:
    """The camera `own` in the model of `camera`, which may have more parameters; None where it has too few."""
    if camera.model == own.model:
        return list(own.params)
    if camera.model.name not in ("SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "FULL_OPENCV"):
        return None
    values, known = _named(own), _named(camera)
    one = "f" in [name.strip() for name in camera.params_info.split(",")]
    if any(value != 0 and name not in known for name, value in values.items()) or (
        one and values["fx"] != values["fy"]
    ):
        return None
    aliases = {"f": "fy", "k": "k1"}
    names = [name.strip() for name in camera.params_info.split(",")]
    return [values.get(aliases.get(name, name), 0.0) for name in names]


def _put_poses(block: Block, made: Any, reconstruction: Any) -> None:
    by_name = {image.name: image for image in reconstruction.images.values()}
    for own in made.images.values():
        image = by_name.get(own.name)
        if image is None:
            raise InputError(f"reconstruction: it has no image {own.name!r}; expected the model of the block", 2)
        if len(list(image.frame.data_ids)) > 1:
            raise InputError(f"reconstruction: image {own.name!r} is one of a rig, whose images have no poses alone", 2)
        image.frame.set_cam_from_world(image.camera_id, own.cam_from_world())


def _put_points(block: Block, reconstruction: Any) -> None:
    points = block.points
    known = reconstruction.points3D
    for name, x, y, z in zip(points["point"].tolist(), points["x"], points["y"], points["z"]):
        if not name.isdigit() or int(name) not in known:
            raise InputError(
                f"reconstruction: it has no point {name!r}; expected the model that the block came from", 2
            )
        if x == x:
            known[int(name)].xyz = (x, y, z)
