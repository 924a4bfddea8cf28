"""The irradiance cache: light that falls on a room's surfaces, computed once for each room, looked up by every frame."""
