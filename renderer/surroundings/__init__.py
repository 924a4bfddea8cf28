"""What stands outside the windows: a neighbourhood by seed, and the view of it all around."""
