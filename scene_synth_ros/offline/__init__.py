"""Bags without DDS: the topics, messages and stamps of the node suite, written straight from scene descriptions."""
