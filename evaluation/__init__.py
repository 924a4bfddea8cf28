"""How good an algorithm's estimates are: metrics by task, breakdowns, confidence intervals, the file of an evaluation and the gate.

Knows neither ROS nor how rooms and images are made: arrays in, numbers out.
"""
