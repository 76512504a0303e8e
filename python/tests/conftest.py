"""Blocks that many tests share: simulated once."""

import subprocess
import sys

import pytest

import misclosure


def command():
    """The package's own command, as words of a command line."""
    return [sys.executable, "-m", "misclosure"]


@pytest.fixture(scope="session")
def program():
    """Runs the program and gives what it printed; a failure shows what it said."""

    def run(*words, code=0):
        done = subprocess.run([*command(), *map(str, words)], capture_output=True, text=True, timeout=600)
        assert done.returncode == code, done.stderr
        return done

    return run


@pytest.fixture(scope="session")
def truth():
    """An error-free dike, 113 images."""
    return misclosure.Block.simulate("dike", points=600, seed=1)


@pytest.fixture(scope="session")
def shutter(truth):
    """The same with a rolling shutter and noise."""
    return truth.inject(["rolling-shutter:readout=0.03", "noise:px=0.3"], seed=1)


@pytest.fixture(scope="session")
def small():
    """A block of few images, which adjusts in a moment."""
    block = misclosure.Block.simulate("closerange", points=150, seed=3)
    return block.inject("noise", px=0.3, seed=3)


@pytest.fixture(scope="session")
def adjusted(shutter):
    """Its adjustment."""
    return shutter.adjust(datum="all")


@pytest.fixture(scope="session")
def found(shutter):
    """Its diagnosis, with what was missing."""
    return shutter.improve()
