"""Datasets of rooms in shards: each a whole bag of a fixed run of rooms, made without DDS, by itself and with the same bytes anywhere."""
