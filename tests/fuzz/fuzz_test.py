#!/usr/bin/python3
"""Runs a fuzz target over its seeds and a fixed number of mutations of them: fuzz_test.py PROGRAM NAME [RUNS]"""

import os
import subprocess
import sys
import tempfile

import seeds

RUNS = 20_000
FEWER_RUNS = {"http_answer": 3_000, "smtp_reply": 2_000,  # each with a connection of its own
              "configuration": 5_000}  # each takes 5 ms under sanitizers


def main(program, name, runs=None):
    runs = runs or FEWER_RUNS.get(name, RUNS)
    with tempfile.TemporaryDirectory(prefix="webots_cloud_fuzz_") as folder:
        corpus = os.path.join(folder, "corpus")
        os.mkdir(corpus)
        for number, seed in enumerate(getattr(seeds, name)()):
            with open(os.path.join(corpus, f"{number:04}"), "wb") as file:
                file.write(seed)
        finished = subprocess.run([program, corpus, f"-runs={runs}", "-seed=1", f"-artifact_prefix={folder}/fault-",
                                   "-print_final_stats=1"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                  env={**os.environ, "TMPDIR": folder})
        said = finished.stdout.decode(errors="replace").splitlines()
        faults = [each for each in os.listdir(folder) if each.startswith("fault-")]
        if finished.returncode == 0 and not faults:
            print("\n".join(said[-6:]))
            return 0
        print("\n".join(line[:300] for line in said[-60:]))
        for fault in faults:
            with open(os.path.join(folder, fault), "rb") as file:
                print(f"{fault}: {file.read()[:4096]!r}")
        return 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
