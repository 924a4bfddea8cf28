"""How kernels are compiled fast and kept on disk; it knows nothing of rooms."""
