"""Cameras: lenses, shutter, rig, primary rays, sensor."""
