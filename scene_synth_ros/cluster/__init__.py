"""Shards on a cluster: the same shard function as Ray tasks.  What a task runs on a node imports the standard library only, at first."""
