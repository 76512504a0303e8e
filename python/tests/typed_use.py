"""What a user writes, for the type checker: `test_types.py` checks it and nothing runs it."""

from typing import Any, Optional

import numpy as np

import misclosure


def told(step: str) -> None:
    print(step)


def use(reconstruction: Any) -> Optional[float]:
    block: misclosure.Block = misclosure.Block.simulate("dike", points=2000, seed=1)
    block = block.inject("rolling-shutter", readout=0.02)
    rows: np.ndarray = block.ties["x"]
    run: misclosure.Run = block.adjust(add=["focal-time"], free="all", datum="all", progress=told)
    found: misclosure.Diagnosis = misclosure.Block.from_pycolmap(reconstruction).improve(significance=1e-3)
    names: list[str] = [cause.effect for cause in found.causes] + [own.kind for own in block.check().mistakes]
    picture: misclosure.Svg = found.run.figure("sensor")
    mended: misclosure.Block = block.mend().block
    print(rows.mean(), names, picture, mended, run.covariance("cam").parameters)
    return run.sigma0
