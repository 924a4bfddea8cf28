"""The seed of rooms that nobody has looked at."""

import argparse
import time


def add_seed(parser: argparse.ArgumentParser) -> None:
    """Add ``--seed``, of the rooms; where it is not given, it is drawn from the clock."""
    parser.add_argument("--seed", type=int, default=int(time.time()), help="of the rooms (default: drawn from the clock)")
