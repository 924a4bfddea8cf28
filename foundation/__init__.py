"""What stands below every package and knows nothing of rooms: how kernels are compiled fast and kept on disk."""
