"""Runs the speed tables, prints them and writes them as JSON.

python -m benchmarks [--json FILE] [--only NAME ...]
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import platform
import subprocess
import sys
from pathlib import Path

from benchmarks.table import Row, render_table

TABLES = {
    "ground_truth": "Ground truth against bare Embree packets",
    "layers": "Layers of the hit record",
    "layout": "Rooms",
    "rooms": "What is odd in rooms",
    "geometry": "Geometry",
    "color": "Colour",
    "camera_rate": "Colour at camera rate",
    "presets": "Light that presets lose",
    "cache": "What the irradiance cache trades",
    "stream": "Messages",
    "bag": "Bags",
    "generate": "Datasets",
    "cost": "Processor hours",
    "convert": "Conversions",
    "dataset": "Reading datasets",
    "start": "Start",
}
"""Module ``<name>_bench`` with ``measure() -> list[Row]`` -> title; each runs in a process of its own."""


def main() -> None:
    """Run all tables, or those named."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument("--only", nargs="+", choices=TABLES, default=list(TABLES))
    parser.add_argument("--rows-of", choices=TABLES, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.rows_of:
        rows = importlib.import_module(f"benchmarks.{arguments.rows_of}_bench").measure()
        print(json.dumps([row._asdict() for row in rows]))
        return
    print(f"{platform.machine()}, {len(os.sched_getaffinity(0))} processors, Python {platform.python_version()}", flush=True)
    tables = {name: _measure(name) for name in arguments.only}
    if arguments.json:
        arguments.json.write_text(json.dumps({name: [row._asdict() for row in rows] for name, rows in tables.items()}, indent=1))


def _measure(name: str) -> list[Row]:
    process = subprocess.run([sys.executable, "-m", "benchmarks", "--rows-of", name], stdout=subprocess.PIPE, text=True, check=True)
    rows = [Row(**row) for row in json.loads(process.stdout.splitlines()[-1])]
    print(render_table(TABLES[name], rows), flush=True)
    return rows


if __name__ == "__main__":
    main()
