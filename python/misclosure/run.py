"""An adjustment."""

from __future__ import annotations

import html
import json
import os
from typing import TYPE_CHECKING, Any, NamedTuple, Optional, Union

from . import _arguments as arguments
from . import _native
from ._arrays import table_of
from .block import Block
from .errors import InputError
from .svg import Svg
from .tables import Record, Records, Table

if TYPE_CHECKING:
    import numpy as np

#: Figures that a notebook shows of a result, where the report has them.
SHOWN = ("ledger", "sensor", "check-plan", "gnss-plan")


class Covariance(NamedTuple):
    """Covariance of the free parameters of a camera, or of all cameras and effects."""

    #: Names, such as `k1`; of all parameters `camera.k1`, and of an effect `focal-time.a`.
    parameters: list[str]
    #: A posteriori, in the parameters' units; shape (parameters, parameters).
    matrix: np.ndarray


class Run:
    """An adjustment. Tables are in the survey's system where the datum is free and control points took it there."""

    def __init__(self, native: _native.Run) -> None:
        self._native = native
        self._summary: Optional[dict[str, Any]] = None
        self._report: Optional[tuple[list[tuple[str, str]], str]] = None

    @classmethod
    def _of(cls, native: _native.Run) -> Run:
        run = cls(native)
        run._raise_failure(run)
        return run

    def _raise_failure(self, result: Any) -> None:
        failure = self._native.failure()
        if failure is not None:
            failure.result = result
            raise failure

    # ---------------------------------------------------------------------------------------------------- figures

    @property
    def summary(self) -> dict[str, Any]:
        """`summary.json`: every figure of the adjustment."""
        if self._summary is None:
            self._summary = json.loads(self._native.summary())
        return self._summary

    @property
    def sigma0(self) -> float:
        """A-posteriori standard deviation of unit weight; NaN without redundancy."""
        value = self.summary["sigma0"]
        return float("nan") if value is None else value

    @property
    def tie_rms_px(self) -> float:
        """RMS of the residuals of tie points, per coordinate, px; NaN without any."""
        value = self.summary["tie_rms_px"]
        return float("nan") if value is None else value

    @property
    def check(self) -> Optional[Record]:
        """Computed minus surveyed coordinates of check points: counts, mean and RMS (m); None without any."""
        return None if self.summary["check"] is None else Record(self.summary["check"])

    @property
    def control(self) -> Optional[Record]:
        """The same of control points."""
        return None if self.summary["control"] is None else Record(self.summary["control"])

    @property
    def mistakes(self) -> Records:
        """Mistakes of people that were found on the way."""
        return Records(self.summary["mistakes"])

    @property
    def messages(self) -> list[str]:
        """What the program says on standard error: doubts, what was set aside."""
        return self._native.messages

    @property
    def model(self) -> str:
        """The model as `model.toml`, which `Block.adjust(model=...)` reads from a file."""
        return self._native.model()

    @property
    def text(self) -> str:
        """What the program prints."""
        return self._native.text()

    # ----------------------------------------------------------------------------------------------------- tables

    @property
    def residuals(self) -> Table:
        """One row per image measurement: image, point (rows of the block's images, and of `points` for the kind tie, of
        `control` for the kind mark), kind, x, y (observed, px), rx, ry (observed minus computed, px), sigma (px). A
        read-only copy, shape (measurements,)."""
        return table_of(self._native, "residuals", {"image": self._native.names("images")})

    @property
    def images(self) -> Table:
        """One row per image: image, camera, flight, x, y, z (m), qw, qx, qy, qz; standard deviations sigma_w1..3 (rad,
        camera axes), sigma_cx, sigma_cy, sigma_cz (m); values that effects have per image. A read-only copy."""
        return table_of(self._native, "images")

    @property
    def points(self) -> Table:
        """One row per adjusted tie point: point, x, y, z, sigma_x, sigma_y, sigma_z (m), images, gsd_m, correlation_xy,
        easting, northing, height. A read-only copy."""
        return table_of(self._native, "points")

    @property
    def checks(self) -> Table:
        """One row per surveyed point: point, role, dx, dy, dz (computed minus surveyed, m), x, y, z, sigma_dx,
        sigma_dy, sigma_dz (m), images, rms_px, easting, northing, height. A read-only copy."""
        return table_of(self._native, "checks")

    @property
    def gnss(self) -> Table:
        """One row per GNSS position: image, dx, dy, dz (computed minus measured, m), x, y, z (m), time_s,
        heading_deg."""
        return table_of(self._native, "gnss")

    @property
    def outliers(self) -> Table:
        """One row per measurement that was set aside: image, point, kind, reason (texts)."""
        return table_of(self._native, "outliers")

    @property
    def cameras(self) -> Table:
        """One row per camera: camera, the twelve parameters, and sigma_f ... sigma_b2 (a posteriori; 0 where held, NaN
        where not computed). Units as in `Block.from_arrays`."""
        import numpy as np

        cameras = self.summary["cameras"]
        width = max((len(name) for name in cameras), default=1)
        names = list(next(iter(cameras.values()))) if cameras else []
        columns = [("camera", f"<U{width}")] + [(name, "<f8") for name in names]
        columns += [(f"sigma_{name}", "<f8") for name in names]
        table = np.zeros(len(cameras), dtype=columns)
        for row, (camera, values) in enumerate(cameras.items()):
            sigmas = [np.nan if own["sigma"] is None else own["sigma"] for own in values.values()]
            table[row] = (camera, *(own["value"] for own in values.values()), *sigmas)
        table.setflags(write=False)
        return table.view(Table)

    @property
    def effects(self) -> Records:
        """One record per parameter of an effect in the model: effect, parameter, value, sigma, unit."""
        effects = self.summary["effects"].items()
        return Records(
            [{"effect": e, "parameter": p, **own} for e, parameters in effects for p, own in parameters.items()]
        )

    def covariance(self, camera: Optional[str] = None) -> Covariance:
        """Covariance of the free parameters of a camera; without a name, of all cameras and effects.

        Raises `InputError` for a camera that has no free parameter.
        """
        import numpy as np

        table = table_of(self._native, "covariance")
        rows = [
            ((own["camera"], own["parameter"]), (own["with_camera"], own["with_parameter"]), own["covariance"])
            for own in table
            if camera is None or own["camera"] == own["with_camera"] == camera
        ]
        places = {key: place for place, key in enumerate(dict.fromkeys(row[0] for row in rows))}
        if not places:
            known = ", ".join(repr(name) for name in self.summary["cameras"])
            raise InputError(f"camera={camera!r}: expected a camera with free parameters; there are {known}", 2)
        matrix = np.empty((len(places), len(places)))
        for one, other, value in rows:
            matrix[places[one], places[other]] = matrix[places[other], places[one]] = value
        named = [name if camera is not None or not of else f"{of}.{name}" for of, name in places]
        return Covariance([str(name) for name in named], matrix)

    # ------------------------------------------------------------------------------------------------------ hand on

    @property
    def adjusted(self) -> Block:
        """The block with the adjusted cameras, poses and points, without what was set aside."""
        return Block(self._native.adjusted())

    def to_pycolmap(self, reconstruction: Any = None) -> Any:
        """A new `pycolmap.Reconstruction` of the adjusted block; or puts cameras, poses and points into the one that
        the block came from, and gives that."""
        from .interop import to_pycolmap

        return to_pycolmap(self.adjusted, reconstruction)

    def save(self, folder: Union[str, os.PathLike[str]]) -> None:
        """Writes the folder of the run as the program does: tables, model, summary, `report.html`, figures."""
        self._native.save(arguments.path("folder", folder))

    # ----------------------------------------------------------------------------------------------------- pictures

    def _reported(self) -> tuple[list[tuple[str, str]], str]:
        if self._report is None:
            self._report = self._native.report()
        return self._report

    @property
    def figures(self) -> list[str]:
        """Names of the report's pictures."""
        return [name for name, _ in self._reported()[0]]

    @property
    def report(self) -> str:
        """The report, one HTML page that needs nothing else."""
        return self._reported()[1]

    def figure(self, name: str) -> Svg:
        """A picture of the report as SVG: `figure("sensor")` is the first whose name begins so, of the final model
        where there are two. `figures` lists the names."""
        found = self._figure(name)
        if found is None:
            raise InputError(f"figure {name!r}: expected one of {', '.join(self.figures)}", 2)
        return found

    def _figure(self, name: str) -> Optional[Svg]:
        pictures = dict(self._reported()[0])
        if name in pictures:
            return Svg(pictures[name])
        alike = [own for own in pictures if str(own).startswith(f"{name}-")]
        alike.sort(key=lambda own: "final" not in own)
        return Svg(pictures[alike[0]]) if alike else None

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(self.text)}</pre>\n" + self._pictures()

    def _pictures(self) -> str:
        shown = (self._figure(name) for name in SHOWN)
        return "\n".join(picture for picture in shown if picture is not None)

    def __repr__(self) -> str:
        summary = self.summary
        check = self.check
        at_checks = "" if check is None else f", check points {1e3 * check['rms_m']['xyz']:.2f} mm (3D RMS)"
        return f"<Run of {summary['block']!r}: sigma0 {self.sigma0:.4f}, ties {self.tie_rms_px:.3f} px RMS{at_checks}>"
