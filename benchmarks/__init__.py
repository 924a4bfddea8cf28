"""Speed tables: ``make bench``.  Ratios are taken side by side in one run; absolute times depend on the machine."""
