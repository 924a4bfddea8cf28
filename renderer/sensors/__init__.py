"""Depth cameras as they are: what a Kinect, an Azure Kinect, a RealSense or a stereo pair reads where the ideal layers tell the truth."""
