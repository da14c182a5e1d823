#!/usr/bin/python3
"""docs/configuration.md is made of the JSON Schemas in config/, which the servers print with `--schema`. Without arguments this checks that
the page is up to date; `--write BIN` writes all three, with the programs in the folder BIN (build/release/bin)."""
import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SERVERS = ('session', 'simulation')
PAGE = ROOT / 'docs/configuration.md'
HEAD = """# Configuration

All keys of the two servers. A configuration is one JSON object; `webots-session-server --check-config FILE` (or `webots-simulation-server`)
says everything that is wrong with one, with line and column, and `--help KEY` shows a key in the terminal. Editors complete and check keys
where a configuration has `"$schema": "../session.schema.json"` or `"../simulation.schema.json"`, the files in [config/](../config).

"Change" says when a changed value takes effect: at `SIGHUP`, while browsers stay connected and simulations go on, or at the next start. At
`SIGHUP` the log names the changed keys that wait for it. In paths, `~` and `$NAME` are replaced from the environment. Megabytes and gigabytes
are 2^20 and 2^30 bytes.

This page is generated; the texts are in the tables of `src/core/config`.
"""


def schema_file(server):
    return ROOT / f'config/{server}.schema.json'


def link(text):
    """Links of the table of keys begin at the root; the page is in docs/."""
    return text.replace('](docs/', '](').replace('[docs/', '[')


def cell(text):
    return text.replace('|', '\\|')


def span(key):
    low, high = (f'{key[name]:,}' if isinstance(key[name], int) else str(key[name]) for name in ('minimum', 'maximum'))
    return f'{low} to {high}'


def value(key):
    """What is written there."""
    if 'enum' in key:
        return ', '.join(f'`{choice}`' for choice in key['enum'])
    if key.get('type') in ('integer', 'number'):
        text = span(key) if 'minimum' in key else f"0, or {span(key['anyOf'][1])}"
        return text + (f", {key['x-unit']}" if 'x-unit' in key else '')
    if key.get('type') == 'array':
        return 'list'
    if 'anyOf' in key:
        return 'string or list'
    if key.get('type') == 'object':
        return 'object'
    return {'boolean': '`true`, `false`', 'string': 'path' if 'minLength' in key else 'string'}.get(key.get('type'), 'anything')


def default(key, required):
    if required:
        return 'required'
    return f"`{json.dumps(key['default'])}`" if 'default' in key else key['x-default']


def rows(keys, required, older, change=True):
    head = ['key', 'value', 'default'] + (['change'] if change else []) + ['meaning']
    lines = [f"| {' | '.join(head)} |", '|' + '---|' * len(head)]
    for name, key in keys.items():
        names = f'`{name}`' + ''.join(f' (older name: `{alias}`)' for alias in older.get(name, []))
        cells = [names, value(key), default(key, name in required)]
        cells += ['`SIGHUP`' if key['x-reloaded'] else 'start'] if change else []
        lines.append('| ' + ' | '.join(cell(link(text)) for text in cells + [key['description']]) + ' |')
    return lines


def inner_tables(name, key):
    """A table for each kind of object that is the value of a key, or in it."""
    items = key.get('items', {})
    lines = []
    for entry in (key, items, *items.get('anyOf', [])):
        if 'properties' not in entry:
            continue
        where = 'The object of' if entry is key else 'Objects in'
        lines += [f"{where} `{name}` {'has' if entry is key else 'have'} these keys:", '',
                  *rows(entry['properties'], entry['required'], {}, change=False), '']
        for inner, described in entry['properties'].items():
            lines += inner_tables(f'{name}.{inner}', described)
    return lines


def page(schemas):
    lines = [HEAD]
    for server, schema in schemas.items():
        lines += [f'## {server.capitalize()} server', '']
        properties, older, topics = schema['properties'], {}, {}
        for name, key in properties.items():
            if 'x-aliasOf' in key:
                older.setdefault(key['x-aliasOf'], []).append(name)
            else:
                topics.setdefault(key['x-topic'], {})[name] = key
        for topic, keys in topics.items():
            lines += [f'### {topic}', '', *rows(keys, schema['required'], older), '']
            for name, key in keys.items():
                lines += inner_tables(name, key)
    return '\n'.join(lines).rstrip('\n') + '\n'


def self_test():
    """A check that finds nothing must be able to find something."""
    key = {'type': 'number', 'minimum': 0.1, 'maximum': 1000, 'x-unit': 'seconds', 'x-default': 'none', 'x-reloaded': True, 'x-topic': 'T',
           'description': 'see [docs/a.md](docs/a.md#b)'}
    text = page({'session': {'required': [], 'properties': {'k': key}}})
    assert '| `k` | 0.1 to 1,000, seconds | none | `SIGHUP` | see [a.md](a.md#b) |' in text, text


def main():
    self_test()
    if sys.argv[1:2] == ['--write']:
        for server in SERVERS:
            program = Path(sys.argv[2]) / f'webots-{server}-server'
            schema_file(server).write_text(subprocess.run([program, '--schema'], check=True, capture_output=True, text=True).stdout)
    text = page({server: json.loads(schema_file(server).read_text()) for server in SERVERS})
    if sys.argv[1:2] == ['--write']:
        PAGE.write_text(text)
        return 0
    is_current = PAGE.is_file() and PAGE.read_text() == text
    print('docs/configuration.md is that of the schemas' if is_current
          else 'docs/configuration.md is out of date: run tests/hygiene/configuration_reference.py --write build/release/bin')
    return 0 if is_current else 1


if __name__ == '__main__':
    sys.exit(main())
