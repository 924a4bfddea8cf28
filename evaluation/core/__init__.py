"""What every task is made of: metrics, measurements, sums and groups of pixels."""
