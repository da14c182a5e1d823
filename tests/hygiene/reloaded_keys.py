#!/usr/bin/python3
"""Checks what SIGHUP does with each key of the configurations: core/config/config_changes.cpp names it as one that needs a restart (the unit
test config_changes compares that with the table of keys), or else the `apply` of the service copies it. A key that is in neither place
would be read again, and do nothing. Each key also has to occur in the tests of the configuration and of its changes."""
import json
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SERVERS = {'session': 'SessionConfig', 'simulation': 'SimulationConfig'}
UNTESTED = {'$schema', 'publicPort'}  # without effect


def functions(text):
    """Name and head -> body, of a formatted C++ source; of overloads the bodies together."""
    found = {}
    for match in re.finditer(r'^(?! |namespace|struct|class|enum|\}|#|//)([^\n;{}][^;{}]*?)\b([\w:]+)\(([^;{}]*)\)[^;{}]*\n\{\n(.*?)^\}', text, re.M | re.S):
        found.setdefault(match.group(2), []).append((match.group(1) + match.group(3), match.group(4)))
    return found


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
    app = 'SomeServiceParams some_params(Config const& config)\n{\n    SomeServiceParams params;\n    params.a = config.a;\n    params.b = config.b;\n}\n'
    service = 'void SomeService::apply(SomeServiceParams const& params)\n{\n    impl_->params.a = params.a;\n}\n'
    assert len(list(uncopied(app, service, set()))) == 1 and not list(uncopied(app, service, {'b'}))
    assert not list(uncopied(app, service.replace('params.a;', 'params.a + params.b;'), set()))


def main():
    self_test()

    def together(folder):
        return '\n'.join(path.read_text() for path in sorted((ROOT / folder).glob('*.[ch]pp')))

    changes = (ROOT / 'src/core/config/config_changes.cpp').read_text()
    faults, count = [], 0
    for kind, name in SERVERS.items():
        schema = json.loads((ROOT / f'config/{kind}.schema.json').read_text())
        keys = {key for key, about in schema['properties'].items() if 'x-aliasOf' not in about} - UNTESTED
        count += len(keys)
        restart, members = compared(changes, name)
        faults += [f'{kind}: there is no key "{key}" any more' for key in sorted(restart - keys)]
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
