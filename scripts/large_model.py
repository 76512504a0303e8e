#!/usr/bin/env python3
"""Writes a large error-free problem for measuring imports: large_model.py bal|colmap MEASUREMENTS PATH.

A strip of images looks down on points of a plane; five neighbouring images see each point. `bal` writes the file PATH,
`colmap` a binary model into the folder PATH.
"""

import os
import random
import struct
import sys

RAYS = 5
BASE_M, HEIGHT_M = 10.0, 100.0
F, SIDE_PX = 5000.0, 6000
POINTS_PER_IMAGE = 1000


def scene(measurements):
    """Images, and points with the first of the images that see them: `(X, Y, first)`."""
    points = measurements // RAYS
    images = points // POINTS_PER_IMAGE + RAYS
    draw = random.Random(1).uniform

    def point(first):
        # The middle one of the five is above it.
        return (first + draw(1.5, 2.5)) * BASE_M, draw(-50.0, 50.0), first

    return images, [point(number // POINTS_PER_IMAGE) for number in range(points)]


def seen(point, image):
    """Place in an image, px from its middle, y up."""
    return F * (point[0] - image * BASE_M) / HEIGHT_M, F * point[1] / HEIGHT_M


def write_bal(path, images, points):
    with open(path, "w") as file:
        file.write(f"{images} {len(points)} {len(points) * RAYS}\n")
        for number, point in enumerate(points):
            for image in range(point[2], point[2] + RAYS):
                x, y = seen(point, image)
                file.write(f"{image} {number} {x!r} {y!r}\n")
        for image in range(images):
            # No rotation: the camera of BAL looks along -z. t = -C.
            numbers = [0.0, 0.0, 0.0, -image * BASE_M, 0.0, -HEIGHT_M, F, 0.0, 0.0]
            file.write("".join(f"{number!r}\n" for number in numbers))
        for x, y, _ in points:
            file.write(f"{x!r}\n{y!r}\n0.0\n")


def write_colmap(path, images, points):
    os.makedirs(path)
    of_image = [[] for _ in range(images)]
    with open(os.path.join(path, "points3D.bin"), "wb") as file:
        file.write(struct.pack("<Q", len(points)))
        for number, point in enumerate(points):
            file.write(struct.pack("<QdddBBBdQ", number + 1, point[0], point[1], 0.0, 0, 0, 0, 0.0, RAYS))
            for image in range(point[2], point[2] + RAYS):
                file.write(struct.pack("<II", image + 1, len(of_image[image])))
                of_image[image].append(number)
    with open(os.path.join(path, "cameras.bin"), "wb") as file:
        # SIMPLE_PINHOLE.
        file.write(struct.pack("<QIiQQddd", 1, 1, 0, SIDE_PX, SIDE_PX, F, SIDE_PX / 2, SIDE_PX / 2))
    with open(os.path.join(path, "images.bin"), "wb") as file:
        file.write(struct.pack("<Q", images))
        for image, numbers in enumerate(of_image):
            # Half a turn about x looks down: t = -R C.
            t = (-image * BASE_M, 0.0, HEIGHT_M)
            file.write(struct.pack("<I7dI", image + 1, 0.0, 1.0, 0.0, 0.0, *t, 1) + f"{image:06}.jpg".encode() + b"\0")
            file.write(struct.pack("<Q", len(numbers)))
            for number in numbers:
                x, y = seen(points[number], image)
                file.write(struct.pack("<ddQ", SIDE_PX / 2 + x, SIDE_PX / 2 - y, number + 1))


def main():
    if len(sys.argv) != 4 or sys.argv[1] not in ("bal", "colmap") or not sys.argv[2].isdigit():
        sys.exit(__doc__)
    images, points = scene(int(sys.argv[2]))
    write = write_bal if sys.argv[1] == "bal" else write_colmap
    write(sys.argv[3], images, points)
    print(f"{images} images, {len(points)} points, {len(points) * RAYS} measurements")


if __name__ == "__main__":
    main()
