"""Whether a bag is what its own settings give: its frames, scans and readings, made again and compared."""
