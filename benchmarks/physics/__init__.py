"""Rooms in a physics engine of others: what stands, lies and hangs in them stays where it is."""
