"""Runs the speed tables, prints them and writes them as JSON.

python -m benchmarks [--json FILE] [--only NAME ...]
"""

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
    "ground_truth": ("Ground truth against bare Embree packets", "renderer_tables:measure_ground_truth"),
    "layers": ("Layers of the hit record", "renderer_tables:measure_layers"),
    "layout": ("Rooms", "layout_bench:measure"),
    "rooms": ("What is odd in rooms", "rooms_bench:measure"),
    "geometry": ("Geometry", "renderer_tables:measure_geometry"),
    "color": ("Colour", "color_bench:measure"),
    "camera_rate": ("Colour at camera rate", "camera_rate_bench:measure"),
    "presets": ("Light that presets lose", "renderer_tables:measure_presets"),
    "cache": ("What the irradiance cache trades", "cache_bench:measure"),
    "stream": ("Messages", "message_tables:measure_stream"),
    "bag": ("Bags", "message_tables:measure_bag"),
    "generate": ("Datasets", "generate_bench:measure"),
    "cost": ("Processor hours", "cost_bench:measure"),
    "convert": ("Conversions", "reading_bench:measure_conversions"),
    "dataset": ("Reading datasets", "reading_bench:measure_datasets"),
    "start": ("Start", "message_tables:measure_start"),
}
"""Name -> title, and the function of this folder that returns the table's rows; each runs in a process of its own."""


def main() -> None:
    """Run all tables, or those named."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument("--only", nargs="+", choices=TABLES, default=list(TABLES))
    parser.add_argument("--rows-of", choices=TABLES, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.rows_of:
        module, function = TABLES[arguments.rows_of][1].split(":")
        rows = getattr(importlib.import_module(f"benchmarks.{module}"), function)()
        print(json.dumps([row._asdict() for row in rows]))
        return
    print(f"{platform.machine()}, {len(os.sched_getaffinity(0))} processors, Python {platform.python_version()}", flush=True)
    tables = {name: _measure(name) for name in arguments.only}
    if arguments.json:
        arguments.json.write_text(json.dumps({name: [row._asdict() for row in rows] for name, rows in tables.items()}, indent=1))


def _measure(name: str) -> list[Row]:
    process = subprocess.run([sys.executable, "-m", "benchmarks", "--rows-of", name], stdout=subprocess.PIPE, text=True, check=True)
    rows = [Row(**row) for row in json.loads(process.stdout.splitlines()[-1])]
    print(render_table(TABLES[name][0], rows), flush=True)
    return rows


if __name__ == "__main__":
    main()
