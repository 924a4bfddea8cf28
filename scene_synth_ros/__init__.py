"""The only package that knows ROS: nodes, conversions, bags and the command line."""
