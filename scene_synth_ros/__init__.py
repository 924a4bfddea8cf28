"""The only package that knows ROS: nodes, conversions, bags and the command line."""

import os
import signal

from scene_synth_ros.suite.environment import LAUNCH, SUPERVISED, die_with_launch

if {LAUNCH, SUPERVISED} & os.environ.keys():  # Ctrl-C ends a node that still loads its modules without a traceback
    signal.signal(signal.SIGINT, signal.SIG_DFL)
die_with_launch()
