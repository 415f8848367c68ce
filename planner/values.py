"""Read-only arrays and content hashes for the values that flow through a job."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

__all__ = ["content_sha256", "frozen_array"]


def frozen_array(values: ArrayLike, dtype: DTypeLike, shape: tuple[int | None, ...]) -> NDArray[Any]:
    """Copy ``values`` to a contiguous read-only array of ``dtype``.

    Args:
        values: anything that numpy can read.
        dtype: dtype of the result.
        shape: expected shape; None stands for any length.

    Raises:
        ValueError: if the shape differs.
    """
    array = np.array(values, dtype=dtype, order="C", copy=True)
    if array.size == 0 and len(shape) > 1 and array.ndim == 1:
        array = array.reshape([0 if n is None else n for n in shape])
    if array.ndim != len(shape) or any(
        want is not None and want != have for want, have in zip(shape, array.shape, strict=True)
    ):
        raise ValueError(f"expected an array of shape {shape}, got {array.shape}")
    array.setflags(write=False)
    return array


def content_sha256(*parts: NDArray[Any] | str | int | float | bool | None) -> str:
    """SHA-256 over arrays (dtype, shape, bytes) and plain values, in the order given."""
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(f"{part.dtype.str}{part.shape}".encode())
            digest.update(np.ascontiguousarray(part).tobytes())
        else:
            digest.update(repr(part).encode())
        digest.update(b"\0")
    return digest.hexdigest()
