"""Two blocks of the same tables."""

import numpy as np

TABLES = ("cameras", "images", "points", "ties", "control", "marks")


def same_table(one, other):
    """Every column to the last bit; NaN is NaN."""
    assert one.dtype.names == other.dtype.names and len(one) == len(other)
    for name in one.dtype.names:
        np.testing.assert_array_equal(np.asarray(one[name]), np.asarray(other[name]), err_msg=name)


def same(one, other, tables=TABLES):
    """Every table to the last bit."""
    for name in tables:
        same_table(getattr(one, name), getattr(other, name))
