# SPDX-License-Identifier: Apache-2.0
"""Checks of arguments, with texts that say what would be right."""

import math
import operator


def whole(name: str, value, least: int, greatest: int) -> int:
    """Returns a whole number within bounds."""
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} is {value!r}, must be a whole number") from None
    if not least <= number <= greatest:
        raise ValueError(f"{name} is {number}, must be {least} to {greatest}")
    return number


def seed(value) -> int:
    """Returns the seed of random numbers."""
    return whole("seed", value, 0, 2**64 - 1)


def frames_to_use(value) -> int:
    """Returns the number of frames that calibrate and survey use."""
    return whole("frames", value, 4, 100_000)


def positive(name: str, value) -> float:
    """Returns a number above 0."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name} is {value!r}, must be a number") from None
    if not (number > 0 and math.isfinite(number)):
        raise ValueError(f"{name} is {number}, must be > 0 and finite")
    return number


def one_of(name: str, value, known: tuple[str, ...]) -> str:
    """Returns a word that is known."""
    if value not in known:
        raise ValueError(f"{name} is {value!r}, must be one of {', '.join(known)}")
    return value
