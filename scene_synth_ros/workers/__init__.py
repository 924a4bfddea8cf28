"""Processes that share work: a pool of workers, the processors that each takes, the folders that they hold."""
