"""The only package that knows ROS: nodes, conversions, bags and the command line."""

import os
import signal

# Ctrl-C ends a node that still loads its modules without a traceback
if {"SCENE_SYNTH_SUPERVISED", "SCENE_SYNTH_LAUNCH"} & os.environ.keys():
    signal.signal(signal.SIGINT, signal.SIG_DFL)
