#!/usr/bin/env python3
"""check_colmap.py MODEL OUT: pycolmap opens an exported COLMAP model, finds the point errors that were written with it, and writes it to OUT.

Exits with 1 where an error differs by more than 1e-6 px, or where the verification points beside the model are missed.
"""

import csv
import sys
from pathlib import Path

import numpy as np
import pycolmap

LIMIT_PX = 1e-6


def main(folder, out):
    model = pycolmap.Reconstruction(folder)
    worst = 0.0
    for point in model.points3D.values():
        errors = []
        for element in point.track.elements:
            image = model.images[element.image_id]
            seen = image.points2D[element.point2D_idx].xy
            errors.append(np.linalg.norm(image.project_point(point.xyz) - seen))
        worst = max(worst, abs(np.mean(errors) - point.error))
    missed = 0.0
    images = {image.name: image for image in model.images.values()}
    with open(Path(folder) / "verification.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        world = np.array([float(row[key]) for key in ("world_x", "world_y", "world_z")])
        stated = np.array([float(row["x"]), float(row["y"])])
        missed = max(missed, np.linalg.norm(images[row["image"]].project_point(world) - stated))
    print(
        f"{len(model.images)} images, {len(model.points3D)} points: errors agree to {worst:.1e} px, "
        f"{len(rows)} verification points are met to {missed:.1e} px"
    )
    Path(out).mkdir(parents=True, exist_ok=True)
    model.write(out)
    ok = len(model.points3D) > 0 and len(rows) > 0 and worst < LIMIT_PX and missed < LIMIT_PX
    return 0 if ok else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:3]))
