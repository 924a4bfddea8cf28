"""What becomes of linear colour: denoising, white balance, tone curve; the layers of a frame."""
