"""What a dataset will cost: a few of its rooms are made and measured, and a total with its interval is said for all."""
