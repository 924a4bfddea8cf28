"""A window of 1 m2 in the wall of greatest y of a room, and a sun that shines on it."""

import numpy as np
from box_room import DARK, quad

LUX = np.array([6e4, 5e4, 4e4])
WAY = np.array([0.0, 0.6, 0.8])
SUNNY = DARK._replace(sun=np.array([*WAY, 1e-5, *(LUX / (2e-5 * np.pi))], np.float32))
MATT = {"roughness": 1.0, "ior": 1.0}
PANE = quad((-0.5, 0, 1.0), (1, 0, 0), (0, 0, 1), portal=True, transmission=0.8, ior=1.0, object_id=1)
