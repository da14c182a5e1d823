#!/usr/bin/python3
"""Every file that names the release names that of CMakeLists.txt."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NUMBER = r"(\d+\.\d+\.\d+)"
# file -> how it names the release, at least once
NAMED = {
    "CHANGELOG.md": rf"\A.*?\n## {NUMBER} - \d{{4}}-\d\d-\d\d\n",  # the newest one
    "cmake/vcpkg/vcpkg.json": rf'^  "version": "{NUMBER}",$',
    "config/kubernetes/site/kustomization.yaml": rf"newTag: {NUMBER}",
    "docs/clusters.md": rf"webots-cloud/(?:simulation-server|session-server|\$image):{NUMBER}",
}


def faults(release, read):
    for name, pattern in NAMED.items():
        found = re.findall(pattern, read(name), re.M | re.S)
        if not found:
            yield f"{name} names no release"
        yield from (f"{name} names {each}, the release is {release}" for each in found if each != release)


def self_test():
    """A check that finds nothing must be able to find something."""
    changes = "# Changes\n\n## 1.2.3 - 2026-01-02\n\n## 1.2.2 - 2026-01-01\n"
    texts = {"CHANGELOG.md": changes, "cmake/vcpkg/vcpkg.json": '  "version": "1.2.3",\n', "config/kubernetes/site/kustomization.yaml": "newTag: 1.2.3-R2025a",
             "docs/clusters.md": "`webots-cloud/$image:1.2.3`"}
    assert not list(faults("1.2.3", texts.get)), list(faults("1.2.3", texts.get))
    assert len(list(faults("1.3.0", texts.get))) == len(NAMED)
    assert len(list(faults("1.2.3", lambda name: ""))) == len(NAMED)


def main():
    self_test()
    release = re.search(rf"^project\(webots_cloud VERSION {NUMBER}", (ROOT / "CMakeLists.txt").read_text(), re.M)[1]
    found = list(faults(release, lambda name: (ROOT / name).read_text()))
    print("\n".join(found) or f"{len(NAMED)} files name {release}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
