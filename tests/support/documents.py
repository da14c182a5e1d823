"""What docs/proxies.md tells operators to write, for tests to run."""

import os
import re

PROXIES = os.path.join(os.path.dirname(__file__), "..", "..", "docs", "proxies.md")


def documented_rules(language, path, port):
    """The rules below a path, of `nginx` or `apache`, with another path and another port of the session server."""
    with open(PROXIES) as file:
        rules, = re.findall(rf"^```{language}\n(.*?)^```$", file.read(), re.M | re.S)
    for theirs, ours in (("/webots", path), ("1999", str(port))):
        assert theirs in rules, f"{PROXIES} does not mention {theirs} any more"
        rules = rules.replace(theirs, ours)
    return rules
