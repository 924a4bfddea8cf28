"""Materials, colours, lamps and daylight of a room."""
