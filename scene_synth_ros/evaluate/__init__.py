"""Judges an algorithm: pairs its estimates with the truth at equal stamps, in bags and live, and hands both to :mod:`evaluation`."""
