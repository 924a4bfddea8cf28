"""Recorded frames in the forms that other programs read: one writer a file, one row of ``formats.FORMATS`` each."""
