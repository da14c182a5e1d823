#!/usr/bin/python3
"""Checks what SIGHUP does with each key of the configurations: core/config/config_changes.cpp names it as one that needs a restart, or else
README.md names it as one that is reloaded, and the `apply` of the service copies it. A key that is in neither place would be read
again, and do nothing. Each key also has to occur in the tests of the configuration and of its changes."""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
READS = re.compile(r'(?<!inner\.)\b(?:read\w*|find)\(\s*(?:\*?reader,\s*)?"(\w+)"|string_view key = "(\w+)"')
ALIASES = {'fullyQualifiedDomainName': 'server'}
SERVERS = {'session': ('parse_session_config', 'SessionConfig', '## Session server'),
           'simulation': ('parse_simulation_config', 'SimulationConfig', '## Simulation server')}


def functions(text):
    """Name and head -> body, of a formatted C++ source; of overloads the bodies together."""
    found = {}
    for match in re.finditer(r'^(?! |namespace|struct|class|enum|\}|#|//)([^\n;{}][^;{}]*?)\b([\w:]+)\(([^;{}]*)\)[^;{}]*\n\{\n(.*?)^\}', text, re.M | re.S):
        found.setdefault(match.group(2), []).append((match.group(1) + match.group(3), match.group(4)))
    return found


def keys_read(text, entry):
    """The keys that a function asks its reader for, itself or by what it calls."""
    bodies = functions(text)
    todo, seen, keys = [entry], set(), set()
    while todo:
        name = todo.pop()
        if name in seen:
            continue
        seen.add(name)
        for _, body in bodies.get(name, []):
            keys |= {ALIASES.get(key, key) for pair in READS.findall(body) for key in pair if key}
            todo += re.findall(r'\b(read_\w+)\(', body)
    return keys


def compared(text, config):
    """The keys that need a restart, and the members of the configuration that hold them."""
    common = re.search(r'void compare_common\(.*?\n    \}\n', text, re.S).group()
    own = next(body for head, body in functions(text)['keys_for_restart'] if config in head)
    members = set(re.findall(r'running\.([\w.]+)', common + own))
    address = re.search(r'struct PublicAddress\n\{(.*?)^\};', (ROOT / 'include/webots_cloud/public_address.hpp').read_text(), re.M | re.S).group(1)
    fields = re.findall(r'^    [\w:]+ (\w+) = ', address, re.M)
    assert len(fields) >= 4, 'PublicAddress is written in another way'
    if members.issuperset(f'address.{field}' for field in fields):
        members.add('address')
    return set(re.findall(r'compare\("(\w+)"', common + own)), members


def documented(readme, heading):
    """The keys that README.md calls reloaded."""
    section = readme.split(heading + '\n')[1].split('\n## ')[0] + '\n\n'
    paragraph = re.search(r'^`SIGHUP`.*?(?=\n\n)', section, re.M | re.S).group()
    return set(re.findall(r'`(\w+)`', paragraph)) - {'SIGHUP', 'SIGTERM', 'SIGINT'}


def uncopied(app, services, restart_members):
    """Parameters that come from a key which may be reloaded, and that an `apply` which copies one by one does not copy."""
    applied = {name.split('::')[0]: body for name, all_of in functions(services).items() if name.endswith('::apply') for _, body in all_of}
    for name, all_of in functions(app).items():
        for head, body in all_of:
            service = re.match(r'(?:result<)?(\w+)Params', head)
            copy = service and applied.get(service.group(1))
            if not copy or 'std::move(params)' in copy or '= params;' in copy:
                continue
            for param, expression in re.findall(r'params\.(\w+) = ([^;]*);', body):
                for member in re.findall(r'\bconfig\.(\w+(?:\.\w+)*)', expression):
                    if member not in restart_members and not re.search(rf'\bparams\.{param}\b', copy):
                        yield f'{name}: `params.{param}` has config.{member}, which {service.group(1)}::apply does not copy'


def self_test():
    """A check that finds nothing must be able to find something."""
    config = 'void read_a(ConfigReader& reader, A& a)\n{\n    reader.read("x", a.x);\n}\n\nResult parse(Text text)\n{\n    read_a(*reader, a);\n' \
             '    read_seconds(*reader, "y", a.y, 0);\n    inner.read("z", a.z);\n}\n'
    assert keys_read(config, 'parse') == {'x', 'y'}
    app = 'SomeServiceParams some_params(Config const& config)\n{\n    SomeServiceParams params;\n    params.a = config.a;\n    params.b = config.b;\n}\n'
    service = 'void SomeService::apply(SomeServiceParams const& params)\n{\n    impl_->params.a = params.a;\n}\n'
    assert len(list(uncopied(app, service, set()))) == 1 and not list(uncopied(app, service, {'b'}))
    assert not list(uncopied(app, service.replace('params.a;', 'params.a + params.b;'), set()))


def main():
    self_test()

    def together(folder):
        return '\n'.join(path.read_text() for path in sorted((ROOT / folder).glob('*.[ch]pp')))

    config = together('src/core/config')
    changes = (ROOT / 'src/core/config/config_changes.cpp').read_text()
    readme = (ROOT / 'README.md').read_text()
    faults, count = [], 0
    for kind, (entry, name, heading) in SERVERS.items():
        keys = keys_read(config, entry)
        count += len(keys)
        restart, members = compared(changes, name)
        reloaded = documented(readme, heading)
        faults += [f'{kind}: "{key}" is neither in config_changes.cpp (needs a restart) nor in the paragraph on SIGHUP of README.md (is reloaded)'
                   for key in sorted(keys - restart - reloaded)]
        faults += [f'{kind}: "{key}" is reloaded according to README.md, and needs a restart according to config_changes.cpp'
                   for key in sorted(restart & reloaded)]
        faults += [f'{kind}: there is no key "{key}" any more' for key in sorted((restart | reloaded) - keys)]
        for test in ('config_test', 'config_changes_test'):
            quoted = (ROOT / f'tests/unit/core/config/{test}.cpp').read_text()
            faults += [f'{kind}: {test} does not know "{key}"' for key in sorted(keys) if f'"{key}"' not in quoted and f'\\"{key}\\"' not in quoted]
        server = (ROOT / f'src/app/{kind}_server.cpp').read_text()
        faults += [f'{kind}: {fault}' for fault in uncopied(server, together('src/service'), members)]
    print('\n'.join(faults) or f'SIGHUP applies or names each of {count} keys')
    assert count >= 70, f'only {count} keys were found: is core/config written in another way?'
    return 1 if faults else 0


if __name__ == '__main__':
    sys.exit(main())
