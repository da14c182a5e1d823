#!/usr/bin/python3
"""Checks who includes whom against the floors of ARCHITECTURE.md, and that public headers stay light."""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# Folder -> what its files may include. Names are prefixes: of our own paths, or of library headers.
STD = r'[a-z_0-9/]+'  # a header without extension
VALUES = ['webots_cloud/error.hpp', 'webots_cloud/time.hpp', 'webots_cloud/load_report.hpp', 'webots_cloud/server_load.hpp',
          'webots_cloud/notice.hpp',
          'webots_cloud/project_ref.hpp', 'webots_cloud/website_project.hpp',
          'webots_cloud/config.hpp', 'webots_cloud/version.hpp', 'webots_cloud/scheduler.hpp',
          'webots_cloud/transport/http.hpp', 'webots_cloud/transport/host_metrics.hpp', 'webots_cloud/transport/logger.hpp']
ASIO_CORE = ['boost/asio/' + name for name in (
    'any_io_executor', 'as_tuple', 'awaitable', 'bind_cancellation_slot', 'cancellation_signal', 'co_spawn', 'deferred', 'detached',
    'experimental/awaitable_operators', 'experimental/channel', 'this_coro', 'use_awaitable', 'io_context')]
FLOORS = {
    'include/webots_cloud': ['webots_cloud/', 'boost/system/', 'boost/asio/awaitable', 'boost/asio/any_io_executor'],
    'include/webots_cloud/testing': ['webots_cloud/', *ASIO_CORE],
    'src/core': [*VALUES, 'src/core/', 'boost/json', 'boost/url/', 'boost/system/',
                 'boost/archive/iterators/'],
    'src/web': ['src/web/'],
    'src/async': ['webots_cloud/error.hpp', 'webots_cloud/time.hpp', 'webots_cloud/transport/clock.hpp', 'src/async/', *ASIO_CORE],
    'src/service': ['webots_cloud/', 'src/core/', 'src/async/', 'src/service/', 'src/web/', *ASIO_CORE],
    'src/testing': ['webots_cloud/', 'src/async/', *ASIO_CORE],
    'src/adapters': ['webots_cloud/', 'src/core/', 'src/async/', 'src/adapters/', 'boost/', 'openssl/', 'spdlog/', 'curl/',
                     'git2', 'zlib.h', 'archive', 'sys/', 'linux/', 'netinet/', 'netdb.h', 'unistd.h', 'fcntl.h', 'dirent.h', 'spawn.h', 'semaphore.h', 'fts.h',
                     'dlfcn.h'],
    'src/app': ['webots_cloud/', 'src/core/', 'src/app/', 'boost/asio/', 'boost/json/', 'boost/program_options/', 'sys/', 'unistd.h'],
    'apps': ['webots_cloud/daemon.hpp', 'webots_cloud/servers.hpp'],
}
# One sentence for each arrow that must not be.
WHY = {
    'src/core': 'decisions know no clock, no I/O and no Asio: they get the time as an argument and return what to do',
    'src/service': 'services reach the world through seams only, so that they run in virtual time and in other programs',
    'src/adapters': 'adapters know one library each and no service: they meet in src/app',
    'include/webots_cloud': 'a public header costs every user its includes: the awaitable is the heaviest that is allowed',
}
# Public headers that run the coroutines of tests need more of Asio than others.
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


def check(path):
    floor = floor_of(path)
    text = (ROOT / path).read_text()
    allowed = FLOORS[floor]
    for number, line in enumerate(text.splitlines(), 1):
        match = re.match(r'\s*#include\s+([<"])([^>"]+)[>"]', line)
        if match:
            name = resolve(path, match.group(2), match.group(1) == '"')
            if not re.fullmatch(STD, name) and not any(name.startswith(a) for a in allowed):
                yield f'{path}:{number}: {floor} must not include {name}: {WHY.get(floor, "see ARCHITECTURE.md")}'
        if floor in ('src/core', 'src/service') and CLOCKS.search(line):
            yield f'{path}:{number}: names a clock or timer: take the time as an argument or from the Clock'


def main():
    files = sorted(str(p.relative_to(ROOT)) for f in ('include', 'src', 'apps') for p in (ROOT / f).rglob('*.[ch]pp'))
    files = [f for f in files if floor_of(f)]
    assert len(files) > 50, 'the checkout has lost its sources'
    found = [fault for f in files for fault in check(f)]
    print('\n'.join(found) or f'{len(files)} files stay on their floors')
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())
