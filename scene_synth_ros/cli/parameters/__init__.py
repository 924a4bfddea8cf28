"""Parameters of runs and of single renderings: profiles, overlays and single values."""
