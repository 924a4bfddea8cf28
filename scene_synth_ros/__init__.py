"""The only package that knows ROS: nodes, conversions, bags and the command line."""

import os
import signal

if "SCENE_SYNTH_SUPERVISED" in os.environ:  # Ctrl-C ends a node of a run that still loads its modules without a traceback
    signal.signal(signal.SIGINT, signal.SIG_DFL)
