"""From a grammar and a request to a parse tree: what is in the room, before anything has its place."""
