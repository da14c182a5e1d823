#!/usr/bin/python3
"""Checks tables and lists of HACKING.md, docs/inside.md, docs/library.md, docs/recipes.md and docs/long_tests.md against the tree: the public headers of each target, the files that write `/metrics`, the rooms of the unit tests, which files may start threads; the labels of tests, the codes
of failures, and figures of tests."""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# Whatever starts threads has a row in "Threads". Add the file here together with the row.
STARTS_THREADS = {
    'adapters/files/mount_thread', 'adapters/git/git2_transport', 'adapters/git/git_coalesced_fetches', 'adapters/git/git_lfs',
    'adapters/git_cache/git_checkout', 'adapters/git_packs/git_copy', 'adapters/host/nvml', 'adapters/logs/kept_file', 'adapters/logs/line_file',
    'adapters/logs/simulation_logs', 'adapters/mail/curl_smtp', 'adapters/process/guard_probe', 'adapters/process/process_host', 'adapters/process/process_inspection',
    'adapters/process/subordinate_users',
    'adapters/projects/folder_meter', 'adapters/projects/text_files', 'adapters/projects/world_finder',
    'adapters/threads/blocking_pool', 'adapters/threads/worker_threads', 'app/doctor/aside', 'app/signals'}
PROJECT_SOURCE = re.compile(r'\bpublic ProjectSource\b')  # the row "pools of the project sources" is for all of them
THREADS = re.compile(r'\b(?:std::j?thread\(|std::j?thread \w+[({;]|std::vector<std::j?thread>|asio::thread_pool\b|BlockingPool\b|WorkerThreads\b)')
QUOTED = re.compile(r'`([^`]+)`')


def table(text, heading):
    """The rows of the table whose first line begins with `heading`, as lists of cells."""
    lines = text[text.index('\n' + heading) + 1:].split('\n')
    rows = []
    for line in lines[2:]:
        if not line.startswith('|'):
            return rows
        rows.append([cell.strip() for cell in line.strip('|').split('|')])
    return rows


def starts_threads(code):
    found = set(THREADS.findall(code))
    return bool(found - {'BlockingPool'} if PROJECT_SOURCE.search(code) else found)


def differences(what, said, is_so):
    return ([f'{what}: {name} is named, but it is not so' for name in sorted(said - is_so)] +
            [f'{what}: {name} is missing' for name in sorted(is_so - said)])


def short(name):
    """Headers in folders are named together."""
    return re.sub(r'/.*', '/*.hpp', name)


def headers_said(text):
    """target -> headers; a row without a target belongs to the one above."""
    found, target = {}, ''
    for cells in table(text, '| target | headers |'):
        target = (QUOTED.findall(cells[0]) or [target])[0]
        found.setdefault(target, set()).update(short(name) for name in QUOTED.findall(cells[1]))
    return found


def headers_of(cmake):
    lists = re.findall(r'target_sources\((\w+) PUBLIC FILE_SET HEADERS [^)]*?FILES(.*?)\)', cmake, re.S)
    return {'webots_cloud::' + target.removeprefix('webots_cloud_'): {short(name) for name in re.findall(r'\$\{headers\}/(\S+)', files)}
            for target, files in lists}


def metrics_said(text):
    table = re.search(r'^\| file \| writes \|\n(.*?)\n\n', text, re.M | re.S).group(1)
    return {Path(name).stem for name in re.findall(r'^\| `([^`]+)`', table, re.M)}


def labels(text):
    return set(QUOTED.findall(re.search(r'^Labels of tests: (.*)\.$', text, re.M).group(1)))


def labels_used():
    lists = [p.read_text() for p in (ROOT / 'tests').rglob('CMakeLists.txt')]
    used = r'LABELS? "?([a-z;]+)|webots_cloud_script_test\(\w+ \S+ ([a-z]+)\)'
    return {name for text in lists for pair in re.findall(used, text) for name in ';'.join(pair).split(';') if name}


def failures_said(text):
    """errc -> label."""
    found = {}
    for codes, _, label in table(text, '| `errc` | when | label |'):
        for code in QUOTED.findall(codes):
            found[code] = code if label == 'the same' else QUOTED.findall(label)[0]
    return found


def failures_of(source):
    body = re.search(r'failure_labels\[\] = .*?;', source, re.S).group(0)
    return dict(re.findall(r'errc::(\w+),\s+"(\w+)"', body))


def number(path, name):
    return int(re.search(rf'^{name} = ([\d_]+)', (ROOT / path).read_text(), re.M).group(1))


def hacking():
    text = ''.join((ROOT / name).read_text() for name in ('HACKING.md', 'docs/recipes.md', 'docs/long_tests.md'))
    found = differences('labels of tests', labels(text), labels_used())
    said, is_so = failures_said(text), failures_of((ROOT / 'src/core/simulation/start_figures.cpp').read_text())
    said = {code: label for code, label in said.items() if label != 'other'}
    found += differences('labels of failures', set(said.items()), set(is_so.items()))
    for sentence, figure in (
            (r'1,000 random sequences', number('tests/integration/torture_test.py', 'SEQUENCES')),
            (r'10,000\s+cycles', number('tests/integration/torture_test.py', 'CYCLES')),
            (r'with 20,000 inputs', number('tests/fuzz/fuzz_test.py', 'RUNS')),
            (r'35 of 35 passed', sum(len(re.findall(r'^    (?:async )?def test_', (ROOT / f'tests/{name}.py').read_text(), re.M))
                                     for name in ('systemd_boot', 'systemd_packages')))):
        if f'{figure:,}' not in (re.findall(sentence, text) or [''])[0]:
            found.append(f'HACKING.md or docs/long_tests.md: "{sentence}" is not so: {figure:,}')
    return found


def check():
    text = (ROOT / 'docs/inside.md').read_text()
    sources = {p: p.read_text() for p in (ROOT / 'src').rglob('*.[ch]pp')}
    found = []
    said, is_so = headers_said(text), headers_of((ROOT / 'src/CMakeLists.txt').read_text())
    assert len(is_so) == 3, is_so.keys()
    for target in said.keys() | is_so.keys():
        found += differences(f'headers of {target}', said.get(target, set()), is_so.get(target, set()))
    named = set(re.findall(r'\.\./include/webots_cloud/(\w+\.hpp)\)', (ROOT / 'docs/library.md').read_text()))
    found += differences('headers that docs/library.md explains', named, {p.name for p in (ROOT / 'include/webots_cloud').glob('*.hpp')})
    found += differences('files that write /metrics', metrics_said((ROOT / 'docs/recipes.md').read_text()),
                         {p.stem for p, code in sources.items() if 'MetricsText' in code and p.stem != 'metrics_text'})
    for floor in ('core', 'service', 'adapters'):
        rooms = [{p.name for p in (ROOT / base / floor).iterdir() if p.is_dir()} for base in ('tests/unit', 'src')]
        found += differences(f'rooms of tests/unit/{floor}', *rooms)
    names = {p: str(p.relative_to(ROOT / 'src').with_suffix('')) for p in sources}
    found += differences('files that start threads (STARTS_THREADS)', STARTS_THREADS,
                         {names[p] for p, code in sources.items() if starts_threads(code) and not names[p].startswith('adapters/threads/off')})
    found += differences('detached coroutines ("the only one waits for a guard")', {'adapters/process/process_host'},
                         {names[p] for p, code in sources.items() if 'asio::detached' in code})
    return found + hacking()


def self_test():
    """A check that finds nothing must be able to find something."""
    text = '\n| target | headers | x |\n|---|---|---|\n| `a::b` | `c.hpp` | y |\n| | `d/*.hpp` | y |\n'
    assert headers_said(text) == {'a::b': {'c.hpp', 'd/*.hpp'}}
    cmake = 'target_sources(webots_cloud_core PUBLIC FILE_SET HEADERS BASE_DIRS ${x} FILES\n ${headers}/a.hpp\n ${headers}/t/b.hpp)'
    assert headers_of(cmake) == {'webots_cloud::core': {'a.hpp', 't/*.hpp'}}
    assert len(differences('x', {'a', 'b'}, {'b', 'c'})) == 2
    assert starts_threads('std::thread(answer).detach()') and starts_threads('BlockingPool pool_;') and not starts_threads('std::thread::id')
    source = 'class X : public ProjectSource { BlockingPool pool_; '
    assert not starts_threads(source) and starts_threads(source + 'std::thread other_;')


def main():
    self_test()
    found = check()
    print('\n'.join(found) or 'the tables of the documents are those of the tree')
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())
