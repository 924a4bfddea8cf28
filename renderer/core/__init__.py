"""What the rest of the renderer stands on: errors, compiled kernels, threads, Embree, random numbers, sampling, colour."""
