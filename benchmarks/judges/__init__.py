"""Programs that nobody here wrote, unmodified, on bags of rooms that nobody has looked at: how well they do against the true poses."""
