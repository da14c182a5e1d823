#!/usr/bin/python3
"""docs/endpoints.md lists the paths of the route tables, with their methods, and who may ask; docs/messages.md the messages that the code of
`/client` and `/class` reads and writes. What the pages say of each is for people, and not looked at here."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ROUTE = re.compile(r'^\s*\{"(/[^"]*)",\s*(?:core::)?Methods::(\w+),\s*(\S+),\s*(?:Upgrade::)?(accepted|ignored),', re.M)
METHODS = {"get": "GET", "read": "GET, HEAD", "post": "POST", "read_and_options": "GET, HEAD, OPTIONS"}
# Of `Route::may_ask`.
FOR = {"everybody": "everybody", "is_operators": "the operator", "may_read_decisions": "the operator, or everybody with `decisionsForAll`",
       "relays": "everybody, with `relay`", "hears_machines": "machines that know the secret, with `announcements`", "has_ticket": "clients with a ticket", "is_person": "browsers that open it as a page", "leads_to_simulation": "clients that know the token of a simulation"}
SERVICES = {"The session server": ["sessions/session_service"],
            "The simulation server": ["simulations/simulation_service", "simulations/status_endpoints"]}


def source(path):
    return (ROOT / "src" / path).read_text()


def section(text, heading):
    begin = text.index(f"\n## {heading}\n")
    return text[begin:text.find("\n## ", begin + 1) % (len(text) + 1)]


def rows(text):
    """The cells of all rows of tables."""
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in text.splitlines() if line.startswith("| `")]


def endpoints():
    page = (ROOT / "docs/endpoints.md").read_text()
    for heading, files in SERVICES.items():
        text = "".join(source(f"service/{name}.cpp") for name in files)
        tables = ROUTE.findall(text)
        assert len(tables) == len(re.findall(r'^\s*\{"/[^"]*",.*::\w+[^}]*\},$', text, re.M)), f"some routes of {files} look different"
        served = {(f"`{path}`", METHODS[methods] + (", WebSocket" if upgrade == "accepted" else ""), FOR[who.rpartition("::")[2]])
                  for path, methods, who, upgrade in tables}
        said = {tuple(row[:3]) for row in rows(section(page, heading))}
        yield from (f"docs/endpoints.md, {heading}: {row} is not in the route table" for row in sorted(said - served))
        yield from (f"docs/endpoints.md, {heading}: {row} is missing" for row in sorted(served - said))


def written(text, *patterns):
    return {word for pattern in patterns for word in re.findall(pattern, text)}


def messages():
    """Heading of docs/messages.md -> what its first column has to begin with, in the code's words."""
    client, relay, waiting = source("core/simulation/client_protocol.cpp"), source("core/relay/relay_messages.cpp"), source("core/waiting/waiting_messages.cpp")
    header, staging = source("core/simulation/client_protocol.hpp"), source("core/simulation/staging_messages.cpp")
    classes = source("core/classes/class_messages.cpp")
    programs = source("core/simulation/editable_files.cpp") + source("core/projects/lesson.cpp")
    return {
        "What browsers say on `/client`": written(client, r'object->if_contains\("([\w ]+)"\)'),
        "Members of `start`": written(client, r'start->if_contains\("(\w+)"\)', r'\{"(\w+)", &StartMessage::') |
                              written(relay, r'(?:is_true|text_of)\(members, "(\w+)"\)'),
        "What browsers are told on `/client`": written(client, r'return concat\("([\w ]+:)') | written(header, r'_(?:message|promise|prefix) = "([^" ]+)') |
                                               written(waiting, r'return concat\("(\w+:)') | written(programs, r'return concat\("(\w+:)') |
                                               written(staging, r'return staging_list_text\("(staged)"'),
        "What clients say on `/class`": written(classes, r'key == "(\w+)"'),
        "What clients are told on `/class`": written(classes, r'message_with\("(\w+)"', r'object\["(error|do)"\]'),
    }


def named(heading, cell):
    """The name of a message in the first cell of its row."""
    name = cell.strip("`")
    found = re.match(r'\{?"([\w ]+)"', name)
    return found.group(1) if found else re.match(r"[\w ]+:|\S+", name).group(0)


def messages_page():
    page = (ROOT / "docs/messages.md").read_text()
    for heading, code in messages().items():
        assert code, f"nothing is found in the code for {heading}"
        said = {named(heading, row[0]) for row in rows(section(page, heading))}
        yield from (f"docs/messages.md, {heading}: {name} is not in the code" for name in sorted(said - code))
        yield from (f"docs/messages.md, {heading}: {name} is missing" for name in sorted(code - said))


found = [*endpoints(), *messages_page()]
print("\n".join(found))
sys.exit(bool(found))
