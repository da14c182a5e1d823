#!/usr/bin/python3
"""How fast the servers are, beside nginx, HAProxy and the floor of bare system calls; all of them measured in one run, in turns.

    cmake --preset release && cmake --build --preset release --target all bench
    WEBOTS_CLOUD_BIN=build/release/bin tests/bench/speed/speed_bench.py [--runs N] [--only WORD] [--quick] [--list]

Prints a Markdown table: median [least .. most] of the runs. Ratios are medians of the ratios of each run, so a machine that slows down
slows both sides. The servers have one core, what loads them the other; needs two. Packages: wrk, nginx-light, haproxy.
"""

import argparse
import datetime
import os
import platform
import re
import statistics
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", ".."))
sys.path[:0] = [HERE, os.path.join(HERE, "..")]
import attack_rows
import crowd_rows
import program_rows
import session_rows
import simulation_rows
from peers import find

ROWS = session_rows.ROWS + simulation_rows.ROWS + program_rows.ROWS + crowd_rows.ROWS + attack_rows.ROWS


def machine(tools=(("nginx", "-v"), ("haproxy", "-v"), ("wrk", "-v"))):
    with open("/proc/cpuinfo") as file:
        model = re.search(r"^model name\s*: (.*)$", file.read(), re.MULTILINE)
    versions = [subprocess.run([find(name), option], capture_output=True, text=True) for name, option in tools]
    names = [re.search(r"nginx/[\d.]+|HAProxy version [\d.]+|wrk [\w.]+", done.stdout + done.stderr) for done in versions]
    return (f"{datetime.date.today()}, {model[1] if model else platform.processor()}, {len(os.sched_getaffinity(0))} cores, "
            f"Linux {platform.release().split('-')[0]}, " + ", ".join(name[0] for name in names if name))


def shown(values):
    """Median and spread in three significant digits."""
    def digits(value):
        return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"
    middle = digits(statistics.median(values))
    return middle if len(values) == 1 else f"{middle} [{digits(min(values))} .. {digits(max(values))}]"


def line(row, samples):
    ours, *peers = samples[0]
    beside = ", ".join(f"{peer} {shown([sample[peer] for sample in samples])}" for peer in peers)
    figures = [row.figure(sample) for sample in samples]
    reached = "yes" if statistics.median(figures) <= row.limit else "**no**"
    return (f"| {row.work} | {row.unit} | {shown([sample[ours] for sample in samples])} | {beside} | {row.goal} | "
            f"{shown(figures)} | {reached} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--only", metavar="WORD", help="rows whose name contains the word")
    parser.add_argument("--quick", action="store_true", help="one run with little load, to see that everything works")
    parser.add_argument("--list", action="store_true", help="print the names of the rows")
    options = parser.parse_args()
    rows = [row for row in ROWS if not options.only or options.only in row.work]
    if options.list:
        print("\n".join(row.work for row in rows))
        return
    print(machine() + "\n")
    print("| work | unit | ours | beside it | goal | figure | reached |\n|---|---|---:|---|---|---:|---|", flush=True)
    for row in rows:
        with row.setting(options.quick) as measure:
            samples = [measure() for _ in range(1 if options.quick else options.runs)]
        print(line(row, samples), flush=True)


if __name__ == "__main__":
    main()
