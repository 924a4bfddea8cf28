"""Our path tracer beside Mitsuba 3: the same scenes, the same light."""
