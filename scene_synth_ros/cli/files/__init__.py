"""The files that commands write, and the rooms of a bag that they are written of."""
