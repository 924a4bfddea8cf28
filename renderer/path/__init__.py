"""The path tracer, its stages and its lights; ground truth from the same primary rays."""
