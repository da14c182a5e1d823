#!/usr/bin/python3
"""Checks who includes whom against the floors and rooms of ARCHITECTURE.md, that public headers stay light, that shared libraries export what
they declare, and that services name their decisions."""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# Folder -> what its files may include. Names are prefixes: of our own paths, or of library headers.
STD = r'[a-z_0-9/]+'  # a header without extension
VALUES = ['webots_cloud/error.hpp', 'webots_cloud/time.hpp', 'webots_cloud/fleet.hpp', 'webots_cloud/server_spec.hpp', 'webots_cloud/guess_limit.hpp', 'webots_cloud/load_report.hpp', 'webots_cloud/server_load.hpp',
          'webots_cloud/listed_world.hpp', 'webots_cloud/notice.hpp', 'webots_cloud/public_address.hpp',
          'webots_cloud/simulation_user.hpp', 'webots_cloud/own_files.hpp',
          'webots_cloud/forge_kind.hpp', 'webots_cloud/project_ref.hpp', 'webots_cloud/website_project.hpp',
          'webots_cloud/config.hpp', 'webots_cloud/network_config.hpp', 'webots_cloud/process_limits.hpp', 'webots_cloud/version.hpp', 'webots_cloud/scheduler.hpp', 'webots_cloud/scheduling_policy.hpp', 'webots_cloud/decision.hpp',
          'webots_cloud/simulation_walls.hpp',
          'webots_cloud/transport/http.hpp', 'webots_cloud/transport/host_metrics.hpp', 'webots_cloud/transport/logger.hpp',
          'webots_cloud/transport/name_answer.hpp',
          'webots_cloud/transport/tunnel_group.hpp']
# What implements the services' seams, or puts everything together: none of the services' business.
ABOVE_SERVICES = ['webots_cloud/adapters', 'webots_cloud/servers.hpp']
# What only our own programs use of the adapters: no public headers, but none of a library either.
FOR_PROGRAMS = [f'src/adapters/{name}.hpp' for name in (
    'files/own_folder', 'host/accounts', 'host/epoll_watches', 'host/program_pages', 'http_client/own_server_probe', 'http_client/web_probe', 'logs/kept_file', 'logs/line_file',
    'mail/mail_probe', 'operator/operator_socket', 'operator/secret_file', 'process/guard_probe', 'process/program_output', 'process/subordinate_users',
    'projects/instance_root', 'projects/subordinate_source', 'threads/low_latency_scheduling', 'tls/certificate_facts')]
ASIO_CORE = ['boost/asio/' + name for name in (
    'any_io_executor', 'as_tuple', 'awaitable', 'bind_cancellation_slot', 'cancellation_signal', 'co_spawn', 'deferred', 'detached', 'post',
    'experimental/awaitable_operators', 'experimental/channel', 'experimental/parallel_group', 'this_coro', 'use_awaitable', 'io_context')]
FLOORS = {
    'include/webots_cloud': ['webots_cloud/', 'boost/system/', 'boost/asio/awaitable', 'boost/asio/any_io_executor'],
    'include/webots_cloud/testing': ['webots_cloud/', *ASIO_CORE],
    'src/core': [*VALUES, 'src/core/', 'boost/json', 'boost/url/', 'boost/system/',
                 'boost/archive/iterators/'],
    'src/web': ['src/web/'],
    'src/async': ['webots_cloud/error.hpp', 'webots_cloud/time.hpp', 'webots_cloud/transport/clock.hpp', 'src/async/', *ASIO_CORE],
    'src/service': ['webots_cloud/', 'src/core/', 'src/async/', 'src/service/', 'src/web/', *ASIO_CORE],
    'src/testing': ['webots_cloud/', 'src/async/', *ASIO_CORE],
    'src/adapters': [*VALUES, 'webots_cloud/transport/', 'webots_cloud/adapters/', 'src/core/', 'src/async/', 'src/adapters/', 'boost/', 'openssl/', 'spdlog/', 'curl/',
                     'git2', 'zlib.h', 'archive', 'sys/', 'linux/', 'netinet/', 'netdb.h', 'unistd.h', 'malloc.h', 'fcntl.h', 'dirent.h', 'link.h', 'spawn.h', 'semaphore.h', 'fts.h', 'arpa/inet.h', 'arpa/nameser.h', 'ares.h', 'ifaddrs.h', 'net/if.h',
                     'dlfcn.h', 'grp.h', 'pwd.h', 'sched.h'],
    'src/guard': ['src/guard/', 'sys/', 'linux/', 'net/', 'netinet/', 'arpa/', 'unistd.h', 'fcntl.h', 'poll.h', 'sched.h', 'mntent.h', 'dirent.h', 'ftw.h', 'grp.h'],
    'src/app': ['webots_cloud/', *FOR_PROGRAMS, 'src/core/', 'src/async/', 'src/app/', 'boost/asio/', 'boost/json/', 'boost/program_options/', 'sys/', 'unistd.h'],
    'src/site': ['webots_cloud/', *FOR_PROGRAMS, 'src/core/', 'src/site/', 'src/app/daemon.hpp', 'src/app/environment.hpp', 'src/app/own_limits.hpp', 'boost/asio/', 'boost/json/', 'sys/', 'unistd.h', 'fcntl.h'],
    'src/manual': ['src/manual/', 'src/app/daemon.hpp', 'src/app/options.hpp', 'src/core/config/', 'src/guard/options.hpp', 'demo_simulator/options.hpp', 'webots_cloud/version.hpp'],
    'apps': ['src/app/daemon.hpp', 'webots_cloud/servers.hpp', 'src/site/site.hpp'],
    'examples/demo_simulator': ['examples/demo_simulator/', 'webots/', 'boost/', 'cairo', 'jpeglib.h', 'spawn.h', 'sys/', 'linux/', 'netinet/', 'arpa/', 'unistd.h', 'fcntl.h', 'poll.h'],
}
# Of what FLOORS allows.
FORBIDDEN = {'src/service': ABOVE_SERVICES, 'src/testing': ABOVE_SERVICES}
# Floor -> its rooms, and which of the others each may look into. The floor's own files, outside of all rooms, are everybody's.
ROOMS = {
    'src/core': {
        'access': [],
        'discovery': ['access'],
        'doctor': [],
        'fleet': ['access'],
        'git': ['access'],
        'load': [],
        'logs': [],
        'notices': [],
        'placement': [],
        'pages': ['load'],
        'projects': ['git'],
        'gallery': ['projects'],
        'sandbox': ['access', 'load'],
        'simulation': ['pages'],
        'classes': ['access', 'simulation'],
        'relay': ['access', 'simulation'],
        'waiting': ['access'],
        'docker': ['simulation'],
        'slurm': [],
        'config': ['access', 'discovery', 'docker', 'gallery', 'notices', 'projects', 'simulation'],
    },
    'src/service': {
        'sandbox': [],
        'docker': [],
        'launch': ['sandbox'],
        'simulations': [],
        'sessions': [],
    },
    'src/adapters': {
        'files': [],
        'host': [],
        'threads': ['files'],
        'names': [],
        'messages': [],
        'tls': ['files'],
        'network': ['files', 'tls'],
        'http_client': ['files', 'host', 'messages', 'names', 'network', 'tls'],
        'gateway': ['messages', 'names', 'network', 'tls'],
        'http_server': ['gateway', 'messages', 'network'],
        'logs': ['files', 'threads'],
        'mail': ['threads'],
        'operator': ['files', 'host', 'messages'],
        'process': ['files', 'threads'],
        'projects': ['files', 'http_client', 'process', 'threads'],
        'git_packs': ['files', 'projects', 'threads'],
        'git_cache': ['files', 'git_packs', 'projects'],
        'git': ['files', 'git_cache', 'git_packs', 'http_client', 'projects', 'threads'],
    },
}
# One sentence for each arrow that must not be.
WHY = {
    'src/core': 'decisions know no clock, no I/O and no Asio: they get the time as an argument and return what to do',
    'src/service': 'services reach the world through seams only, so that they run in virtual time and in other programs',
    'src/adapters': 'adapters know one library each and no service: they meet in src/app',
    'src/guard': 'the guard outlives the server, and stays small: system calls and nothing of ours',
    'examples/demo_simulator': 'it stands in for a program of others: with code of ours it could hide our mistakes',
    'include/webots_cloud': 'a public header costs every user its includes: the awaitable is the heaviest that is allowed',
}
INCLUDE = re.compile(r'^\s*#include\s+([<"])([^>"]+)[>"]', re.M)
# Above the includes of a service.
DECISIONS = re.compile(r'^// Decisions: (core/[\w/]+(?:, core/[\w/]+)*)\.$', re.M)
# What only implementations of the Clock may name.
CLOCKS = re.compile(r'steady_clock::now|system_clock::now|steady_timer|sleep_for|sleep_until')


def floor_of(path):
    return max((f for f in FLOORS if path.startswith(f + '/')), key=len, default=None)


def resolve(path, name, quoted):
    if not quoted:
        return name
    for base in ((ROOT / path).parent, ROOT / 'src'):
        if (base / name).exists():
            return str((base / name).resolve().relative_to(ROOT))
    return name


def room_of(path):
    """The floor and the room of a file of ours; no room: the file is the whole floor's."""
    floor = next((f for f in ROOMS if path.startswith(f + '/')), None)
    inside = path[len(floor) + 1:].split('/') if floor else []
    return floor, inside[0] if len(inside) > 1 else None


def check_rooms(path, name):
    """Says what is wrong with the file at `path`, which includes the file `name`."""
    (floor, room), (other_floor, other) = room_of(path), room_of(name)
    if floor and room and room not in ROOMS[floor]:
        return f'{room} is no room of {floor}'
    if floor is None or floor != other_floor or other is None or other == room:
        return None
    if room is None:
        return f'what all rooms of {floor} share must not include {name}'
    return None if other in ROOMS[floor][room] else f'the room {room} of {floor} must not include {name} of the room {other}'


def check_table():
    """Rooms see each other in one direction, and each has its folder."""
    for floor, rooms in ROOMS.items():
        seen = []
        for room, others in rooms.items():
            for other in others:
                if other not in seen:
                    yield f'{floor}: the room {room} sees {other}, which must stand above it in the table'
            seen.append(room)
            if not (ROOT / floor / room).is_dir():
                yield f'{floor}/{room} is a room without a folder'
            told = re.search(rf'^\| `{room}` \|[^|]*\|([^|]*)\|$', documented(floor), re.M)
            if not told or re.findall(r'`(\w+)`', told.group(1)) != sorted(others):
                yield f'ARCHITECTURE.md does not say of {floor}/{room} what this table says: {sorted(others)}'


def documented(floor):
    """The table of a floor's rooms in ARCHITECTURE.md."""
    text = (ROOT / 'ARCHITECTURE.md').read_text()
    found = re.search(rf'^\| `{floor}/` \|.*?(?=\n\n)', text, re.M | re.S)
    return found.group(0) if found else ''


def may_include(floor, name):
    return any(name.startswith(a) for a in FLOORS[floor]) and not any(name.startswith(f) for f in FORBIDDEN.get(floor, []))


def included(path):
    return {resolve(path, name, mark == '"') for mark, name in INCLUDE.findall((ROOT / path).read_text())}


def reached(path):
    """What a file includes, also by headers of its own floor."""
    found = included(path)
    return found.union(*(reached(name) for name in found if name.startswith('src/service/')))


def check_decisions(path):
    """A service, a .cpp, names decisions that it carries out; what is on pages (`pages`) need not be named."""
    said = DECISIONS.findall((ROOT / path).read_text().split('#include')[0])
    header = str(Path(path).with_suffix('.hpp'))
    own = included(path) | (included(header) if (ROOT / header).exists() else set())
    if not said and any(re.match(r'src/core/(?!pages/)\w+/', name) for name in own):
        yield f'{path} does not say which decisions it carries out, as in "// Decisions: core/simulation/simulation_life."'
    for name in ', '.join(said).split(', ') if said else []:
        if not {f'src/{name}.hpp', f'webots_cloud/{Path(name).name}.hpp'} & reached(path):
            yield f'{path} names {name}, but does not include it'
        if not any((ROOT / 'src' / name).with_suffix(suffix).exists() for suffix in ('.hpp', '.cpp')):
            yield f'{path} names {name}, which does not exist'


def self_test():
    """A check that finds nothing must be able to find something."""
    good = [('src/adapters', 'webots_cloud/transport/clock.hpp'), ('src/adapters', 'webots_cloud/adapters/files.hpp'),
            ('src/service', 'webots_cloud/simulation_service.hpp'), ('src/guard', 'poll.h'), ('src/app', 'webots_cloud/adapters.hpp'),
            ('src/app', 'src/adapters/logs/kept_file.hpp')]
    bad = [('src/adapters', 'webots_cloud/simulation_service.hpp'), ('src/adapters', 'webots_cloud/servers.hpp'), ('src/app', 'src/adapters/tls/tls_trust.hpp'),
           ('src/service', 'webots_cloud/adapters.hpp'), ('src/service', 'webots_cloud/adapters/files.hpp'), ('src/guard', 'src/core/text.hpp'), ('src/core', 'webots_cloud/transport/clock.hpp')]
    assert all(may_include(*pair) for pair in good) and not any(may_include(*pair) for pair in bad)
    assert DECISIONS.findall('// x\n// Decisions: core/a/b, core/c.\n') == ['core/a/b, core/c'] and not DECISIONS.findall('// Decisions: core/a/b,\n// core/c.')


def check(path):
    floor = floor_of(path)
    text = (ROOT / path).read_text()
    for number, line in enumerate(text.splitlines(), 1):
        if match := INCLUDE.match(line):
            name = resolve(path, match.group(2), match.group(1) == '"')
            if not re.fullmatch(STD, name) and not may_include(floor, name):
                yield f'{path}:{number}: {floor} must not include {name}: {WHY.get(floor, "see ARCHITECTURE.md")}'
            if fault := check_rooms(path, name):
                yield f'{path}:{number}: {fault}'
        if floor.startswith('include/') and line.startswith('namespace webots_cloud {'):
            yield f'{path}:{number}: a shared library hides what this declares: namespace WEBOTS_CLOUD_API webots_cloud'
        if floor in ('src/core', 'src/service') and CLOCKS.search(line):
            yield f'{path}:{number}: names a clock or timer: take the time as an argument or from the Clock'


def main():
    self_test()
    files = sorted(str(p.relative_to(ROOT)) for f in ('include', 'src', 'apps', 'examples/demo_simulator') for p in (ROOT / f).rglob('*.[ch]pp'))
    files = [f for f in files if floor_of(f)]
    assert len(files) > 50, 'the checkout has lost its sources'
    services = [f for f in files if f.startswith('src/service/') and f.endswith('.cpp')]
    found = [*check_table(), *(fault for f in files for fault in check(f)), *(fault for f in services for fault in check_decisions(f))]
    print('\n'.join(found) or f'{len(files)} files stay on their floors and in their rooms')
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())
