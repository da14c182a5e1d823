#!/usr/bin/python3
"""How the cost of a unit grows with the number of units: machines, browsers, simulations. A curve that bends upward is a fault.

    WEBOTS_CLOUD_BIN=build/release/bin tests/bench/speed/growth_curves.py [--runs N] [--image FILE] [--quick]

Prints a Markdown table of medians and draws it (package python3-matplotlib). The hard limit of open files bounds the browsers.
"""

import argparse
import os
import resource
import statistics
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", ".."))
sys.path[:0] = [HERE, os.path.join(HERE, "..")]
from peers import Machines, PinnedSessionServer, cpu_seconds
from session_rows import RARELY, crowd, wrk
from simulation_rows import cost_of_running
from support.servers import wait_until


def cost_of_session(count, _run):
    with Machines(count) as machines, PinnedSessionServer(machines, **RARELY) as server:
        server.wait_for_polls(machines)
        before = cpu_seconds(server.pid)
        requests, _ = wrk(server.port, 64, 2)
        return (cpu_seconds(server.pid) - before) * 1e6 / requests


def cost_of_poll(count, _run):
    with Machines(count) as machines, PinnedSessionServer(machines, loadRefresh=2) as server:
        server.wait_for_polls(machines)
        before, polls = cpu_seconds(server.pid), machines.polls()
        wait_until(lambda: machines.polls() >= polls + max(3 * count, 300), "the polls stop", patience=120)
        return (cpu_seconds(server.pid) - before) * 1e6 / (machines.polls() - polls)


MACHINES, BROWSERS, SIMULATIONS = [10, 100, 1000, 10_000], [100, 1000, 10_000, 20_000], [1, 10, 100, 1000]
CURVES = [
    ("machines", "GET /session", "µs of processor", MACHINES, cost_of_session),
    ("machines", "a poll", "µs of processor", MACHINES, cost_of_poll),
    ("browsers", "a change, for each browser", "µs", BROWSERS, lambda count, run: crowd(count, run)["ours"]["flip"] * 1e3 / count),
    ("browsers", "memory of each browser", "kB", BROWSERS, lambda count, run: crowd(count, run)["ours"]["memory"]),
    ("simulations", "each running simulation", "‰ of a core", SIMULATIONS, lambda count, run: cost_of_running(count, 6, run)["cpu"] * 10),
]


def draw(curves, path):
    import matplotlib
    matplotlib.use("svg")
    from matplotlib import pyplot
    matplotlib.rcParams["svg.hashsalt"] = "growth"
    figure, axes = pyplot.subplots(1, len(curves), figsize=(3.2 * len(curves), 3.2), layout="constrained")
    for axis, (unit, name, measured_in, counts, values) in zip(axes, curves):
        axis.plot(counts, values, marker="o", color="#1769aa")
        axis.set(xscale="log", ylim=(0, max(values) * 1.4 or 1), xlabel=unit, ylabel=measured_in, title=name)
        axis.grid(alpha=0.3)
    figure.savefig(path, metadata={"Date": None})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--image", metavar="FILE", help="an SVG")
    parser.add_argument("--quick", action="store_true", help="one run of small numbers, to see that everything works")
    options = parser.parse_args()
    most_files = resource.getrlimit(resource.RLIMIT_NOFILE)[1] - 300
    curves = []
    for unit, name, measured_in, counts, measure in CURVES:
        counts = sorted({min(count, most_files if unit == "browsers" else count) for count in counts[:2 if options.quick else None]})
        values = [statistics.median(measure(count, run) for run in range(1 if options.quick else options.runs)) for count in counts]
        print(f"| {name}, {measured_in} | " + " | ".join(f"{count:,}: {value:.3g}" for count, value in zip(counts, values)) + " |",
              flush=True)
        curves.append((unit, name, measured_in, counts, values))
    if options.image:
        draw(curves, options.image)


if __name__ == "__main__":
    main()
