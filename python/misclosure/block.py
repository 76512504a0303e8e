"""Blocks: what was measured."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Optional, Union

from . import _arguments as arguments
from . import _native
from ._options import several, term, with_values, words
from ._progress import Progress, reporter
from .errors import InputError
from .mistakes import Check, Mended

if TYPE_CHECKING:
    from .diagnosis import Diagnosis
    from .plan import Plan
    from .run import Run
    from .tables import Table

Path = Union[str, "os.PathLike[str]"]


class Block:
    """Images, cameras, tie points and a survey. A block never changes: every method gives a new one.

    Conventions (the book's chapter *Conventions* has all): object space in metres, right-handed, z up; image points in
    pixels from the outer corner of the top-left pixel, x right, y down; the rotation of an image takes world to camera,
    as the unit quaternion qw, qx, qy, qz; angles in radians, times in seconds, temperatures in degrees Celsius.
    """

    def __init__(self, native: _native.Block) -> None:
        if not isinstance(native, _native.Block):
            raise InputError("a block comes from Block.read, from_arrays, from_pycolmap or simulate", 2)
        self._native = native

    # ------------------------------------------------------------------------------------------------- where from

    @classmethod
    def read(cls, folder: Path) -> Block:
        """Reads a block's folder (`block.toml` and CSV tables), as every command of the program does.

        Raises `BlockError` with file, line and column where the content is wrong.
        """
        return cls(_native.Block.read(arguments.path("folder", folder)))

    @classmethod
    def from_arrays(
        cls,
        *,
        images: Any,
        cameras: Any,
        ties: Any = None,
        points: Any = None,
        control: Any = None,
        marks: Any = None,
        sigma: Optional[Mapping[str, float]] = None,
        name: str = "block",
        crs: str = "local",
    ) -> Block:
        """A block from numpy structured arrays, dicts of columns, DataFrames or lists of dicts; one copy of the data.

        Every column has the shape (rows,). Those in brackets may be left out; in them NaN is a value that is not known.

        - `cameras`: camera (name), width_px, height_px, f (px), [ppx, ppy (px; the middle), dcx, dcy (px; as pp), k1
          (px^-2), k2 (px^-4), k3 (px^-6), p1, p2 (px^-1), b1, b2 (1), pixel_um]
        - `images`: image (name), camera (name or row), x, y, z (projection centre, m), qw, qx, qy, qz, [flight (name),
          time_s, temperature_c, gnss_x, gnss_y, gnss_z (antenna, m), gnss_sigma_xy, gnss_sigma_z (m), vx, vy, vz (m/s),
          wx, wy, wz (rad/s), exposure_s, focus_m]
        - `ties`: image (name or row), point (name, row of `points`, or any label), x, y (px), [sigma (px)]
        - `points`: point (name), [x, y, z (m): approximate coordinates]
        - `control`: point (name), x, y, z (m), [role (control or check), sigma_xy, sigma_z (m)]
        - `marks`: image (name or row), point (name or row of `control`), x, y (px), [sigma (px)]
        - `sigma`: standard deviations where a row has none: tie_px, mark_px, control_xy_m, control_z_m, gnss_xy_m,
          gnss_z_m

        What serves nothing is left out, as by `read`: tie points with one ray, check points without a mark, cameras
        without an image (`contents["set_aside"]` counts them).

        Raises `InputError` that names argument, row (from 0), column, and what was expected.
        """
        from ._arrays import block_of

        return cls(block_of(images, cameras, ties, points, control, marks, sigma, name, crs))

    @classmethod
    def from_pycolmap(
        cls,
        reconstruction: Any,
        *,
        name: Optional[str] = None,
        tie_px: Optional[float] = None,
        approximate: bool = False,
    ) -> Block:
        """A block of a `pycolmap.Reconstruction`: its registered images, its points with two rays or more.

        Images come in the order of their names, points in that of their ids, which are their names. `tie_px`: standard
        deviation of an image coordinate (px; a model has none, 0.5 is taken). A camera model that is no Fraser camera
        gets the nearest one; one that is far off is refused unless `approximate`. `notes` says what was guessed.
        """
        from .interop import from_pycolmap

        return cls(from_pycolmap(reconstruction, name, tie_px, approximate))

    @classmethod
    def simulate(
        cls,
        scenario: str = "dike",
        *,
        seed: int = 1,
        noise_px: float = 0.0,
        noise_survey: bool = False,
        start_f: float = 0.0,
        start_position: float = 0.0,
        start_angle: float = 0.0,
        start_without_points: bool = False,
        progress: Progress = None,
        **parameters: float,
    ) -> Block:
        """A simulated block with its truth, as `misclosure simulate`: `Block.simulate("dike", points=2000, seed=1)`.

        `scenario`: a preset (dike, corridor, mapping, closerange) or the path of a scenario's file; `parameters` are
        those of the scenario. `noise_px`: of each image coordinate (px). `noise_survey`: errors of GNSS, control and
        check points as stated. `start_f` (a fraction), `start_position` (m), `start_angle` (degrees),
        `start_without_points`: wrong start values. The same seed gives the same block.
        """
        import math

        overrides = {key: arguments.number(key, value) for key, value in parameters.items()}
        start = [
            arguments.number("start_f", start_f),
            arguments.number("start_position", start_position),
            math.radians(arguments.number("start_angle", start_angle)),
        ]
        with reporter(progress, "simulate") as told:
            made = _native.Block.simulate(
                arguments.text("scenario", os.fspath(scenario)),
                overrides,
                arguments.seed(seed),
                arguments.number("noise_px", noise_px),
                bool(noise_survey),
                start,
                bool(start_without_points),
                told,
            )
        return cls(made)

    def inject(
        self,
        errors: Any = None,
        *,
        mistakes: Any = None,
        seed: int = 1,
        plugins: Any = None,
        **parameters: Any,
    ) -> Block:
        """The block measured again under errors, and with mistakes of people: `misclosure inject --list` has them all.

        `block.inject("rolling-shutter", readout=0.02)` is one error with its parameters;
        `block.inject(["rolling-shutter:readout=0.02", "noise:px=0.3"], seed=7)` are several. Errors need a block with a
        truth (`simulate`). They replace the noise and errors that the block had: name all in one call.
        `mistakes=["scale:of=control,unit=feet"]` are made in the files, last and in order.
        """
        listed = several("errors", errors)
        if parameters and len(listed) != 1:
            raise InputError(f"{', '.join(parameters)}: expected one error that they belong to, found {len(listed)}", 2)
        terms = [term("errors", own) for own in listed]
        texts = [with_values(text, parameters) if parameters else text for text, _ in terms]
        libraries = [arguments.path("plugins", getattr(own, "library", own)) for own in several("plugins", plugins)]
        libraries += [library for _, library in terms if library is not None and library not in libraries]
        made = [own if isinstance(own, str) else term("mistakes", own)[0] for own in several("mistakes", mistakes)]
        if not texts and not made:
            raise InputError("errors: expected one at least, or a mistake", 2)
        block, report = self._native.inject(texts, made, arguments.seed(seed), libraries)
        injected = Block(block)
        injected._injected = json.loads(report)
        return injected

    #: What `inject` did, as `truth/errors.json` has it; `None` of another block.
    _injected: Any = None

    # ---------------------------------------------------------------------------------------------------- contents

    @property
    def name(self) -> str:
        """Name."""
        return self._native.name

    @property
    def crs(self) -> str:
        """Coordinate system, `local` or `EPSG:n`."""
        return self._native.crs

    @property
    def sigma(self) -> dict[str, float]:
        """Standard deviations where a row has none, px and m."""
        return self._native.sigma

    @property
    def notes(self) -> list[str]:
        """What an import guessed or lost."""
        return self._native.notes

    @property
    def contents(self) -> dict[str, Any]:
        """What is in the block, as `misclosure check --json` says it."""
        contents: dict[str, Any] = json.loads(self._native.contents())
        return contents

    @property
    def truth(self) -> Optional[Block]:
        """True cameras, poses, points and error-free measurements of a simulated block; no adjustment reads them."""
        truth = self._native.truth
        return None if truth is None else Block(truth)

    def _table(self, name: str) -> Table:
        from ._arrays import table_of

        if name not in ("ties", "marks"):
            return table_of(self._native, name)
        points = "points" if name == "ties" else "control"
        names = {"image": self._table("images")["image"].tolist(), "point": self._table(points)["point"].tolist()}
        return table_of(self._native, name, names)

    @property
    def images(self) -> Table:
        """One row per image: image, camera, flight, time_s, temperature_c, x, y, z (m), qw, qx, qy, qz, gnss_x, ...
        (see `from_arrays`). A read-only copy, shape (images,)."""
        return self._table("images")

    @property
    def cameras(self) -> Table:
        """One row per camera: camera, width_px, height_px, pixel_um and the twelve parameters. A read-only copy."""
        return self._table("cameras")

    @property
    def ties(self) -> Table:
        """One row per measurement of a tie point: image, point (rows of `images` and `points`), x, y, sigma (px). A
        read-only copy, shape (measurements,)."""
        return self._table("ties")

    @property
    def points(self) -> Table:
        """One row per tie point: point, x, y, z (approximate, m; NaN where not given). A read-only copy."""
        return self._table("points")

    @property
    def control(self) -> Table:
        """One row per surveyed point: point, x, y, z (m), role (control or check), sigma_xy, sigma_z (m). A read-only
        copy."""
        return self._table("control")

    @property
    def marks(self) -> Table:
        """One row per image measurement of a surveyed point: image, point (rows of `images` and `control`), x, y, sigma
        (px). A read-only copy."""
        return self._table("marks")

    def to_pandas(self) -> dict[str, Any]:
        """Every table as a pandas DataFrame, by name."""
        return {
            name: self._table(name).to_pandas() for name in ("cameras", "images", "points", "ties", "control", "marks")
        }

    def write(self, folder: Path) -> None:
        """Writes the block into a new folder, its truth beside it in `truth/`; numbers keep every digit."""
        self._native.write(arguments.path("folder", folder))

    def to_pycolmap(self, reconstruction: Any = None) -> Any:
        """A new `pycolmap.Reconstruction` of this block; or puts its cameras, poses and points into the one that it
        came from, and gives that."""
        from .interop import to_pycolmap

        return to_pycolmap(self, reconstruction)

    # ------------------------------------------------------------------------------------------------- what to do

    def check(self, *, threads: Optional[int] = None) -> Check:
        """Searches the block for mistakes of people, as `misclosure check`."""
        mistakes = json.loads(self._native.mistakes(arguments.threads(threads)))
        return Check({**self.contents, "mistakes": mistakes})

    def mend(self, *, only: Any = None, threads: Optional[int] = None, progress: Progress = None) -> Mended:
        """A copy in which the mistakes that need no person are undone, as `misclosure mend`; `only`: these kinds."""
        kinds = [arguments.text("only", kind) for kind in several("only", only)]
        with reporter(progress, "mend") as told:
            block, report = self._native.mend(kinds, arguments.threads(threads), told)
        return Mended(Block(block), json.loads(report))

    def plan(
        self,
        *,
        significance: Optional[float] = None,
        free: Any = None,
        tie: Optional[str] = None,
        datum: Optional[str] = None,
        threads: Optional[int] = None,
        progress: Progress = None,
    ) -> Plan:
        """What the block would show if it were measured without errors, as `misclosure plan`. Nothing is random: sizes
        follow from the geometry and from the standard deviations that the block states. Options are those of
        `improve`."""
        from .plan import Plan

        line = words(significance=significance, free=free, tie=tie, datum=datum)
        with reporter(progress, "plan") as told:
            return Plan(json.loads(self._native.plan(line, arguments.threads(threads), told)))

    def adjust(
        self,
        *,
        add: Any = None,
        free: Any = None,
        fix: Any = None,
        tie: Optional[str] = None,
        datum: Optional[str] = None,
        loss: Optional[str] = None,
        outliers: Optional[str] = None,
        tie_weights: Optional[str] = None,
        multistart: bool = False,
        model: Optional[Path] = None,
        plugins: Any = None,
        solver: Optional[str] = None,
        threads: Optional[int] = None,
        progress: Progress = None,
    ) -> Run:
        """One adjustment, as `misclosure adjust`: the same options, the same numbers.

        - `add`: effects, as ids (`"focal-time"`), with start values (`("local-flaw", {"x": 2000.0})`), or of one's own
          (`misclosure.effect`)
        - `free`, `fix`: camera parameters or groups (f pp dc radial decentring affinity all none); `tie="dc=pp"`
        - `datum`: free, control, gnss or all; `loss`: none, huber or cauchy; `outliers`: snoop, huber or none
        - `threads`: one per processor; results do not depend on it
        - `progress`: called with each step as a text; True: tqdm, or standard error

        The GIL is released; Ctrl-C stops it. Raises `AdjustmentError` and its kinds; where blunders bend the
        adjustment, `BlunderError.result` holds it.
        """
        from .run import Run

        line = words(
            add=add,
            free=free,
            fix=fix,
            tie=tie,
            datum=datum,
            loss=loss,
            outliers=outliers,
            tie_weights=tie_weights,
            multistart=multistart,
            model=model,
            plugins=plugins,
            solver=solver,
        )
        with reporter(progress, "adjust") as told:
            return Run._of(self._native.adjust(line, arguments.threads(threads), told))

    def diagnose(self, **options: Any) -> Diagnosis:
        """Adjusts the block and names the effect that the model lacks, as `misclosure diagnose`; `run` is of the base
        model. Options are those of `improve`."""
        return self._diagnosed(False, options)

    def improve(self, **options: Any) -> Diagnosis:
        """Diagnoses, adds missing effects and adjusts again until no significant misfit remains, as `misclosure
        improve`; `run` is of the final model.

        Options are those of `adjust`, and `significance` (0.001: the probability that a block without any misfit gets a
        finding), `tolerance_mm` (acceptable point error, mm) and `weights_by_flight`. Without a `datum` all that the
        block has is used. `mend=True` undoes mistakes first.
        """
        return self._diagnosed(True, options)

    def _diagnosed(self, improve: bool, options: dict[str, Any]) -> Diagnosis:
        from .diagnosis import Diagnosis

        threads, progress = arguments.threads(options.pop("threads", None)), options.pop("progress", None)
        if options.pop("mend", False):
            return self.mend(threads=threads, progress=progress).block._diagnosed(
                improve, {**options, "threads": threads, "progress": progress}
            )
        try:
            line = words(**options)
        except TypeError as error:
            # As Python says it of a function.
            raise TypeError(str(error).replace("words()", "improve()" if improve else "diagnose()")) from None
        with reporter(progress, "improve" if improve else "diagnose") as told:
            return Diagnosis._of(self._native.diagnose(line, improve, threads, told))

    # ----------------------------------------------------------------------------------------------------- pictures

    def figure(self) -> Any:
        """Images, control and check points in plan and from the side: SVG, drawn as in the report."""
        from .svg import Svg

        return Svg(self._native.figure())

    def _repr_html_(self) -> str:
        return f"<p>{html.escape(repr(self))}</p>\n{self._native.figure()}"

    def __repr__(self) -> str:
        contents = self.contents
        ties, control, check = contents["ties"], contents["control"], contents["check"]
        return (
            f"<Block {self.name!r}: {contents['images']} images, {len(contents['flights'])} flights, "
            f"{ties['points']} tie points with {ties['measurements']} measurements, "
            f"{control['points']} control and {check['points']} check points>"
        )
