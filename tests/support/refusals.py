"""The sentences with which something is refused, or has ended, from their table (src/core/refusals.cpp): a test names the row, and does not follow
when its words change."""
import re
from pathlib import Path

TABLE = (Path(__file__).resolve().parents[2] / 'src/core/refusals.cpp').read_text()
ROW = re.compile(r'\{R::(\w+), "[\w-]*", [\w:]+, \w+,\s*((?:"(?:[^"\\]|\\.)*"\s*)+)')
SENTENCES = {name: ''.join(re.findall(r'"((?:[^"\\]|\\.)*)"', literals)).replace('\\"', '"') for name, literals in ROW.findall(TABLE)}


def sentence(row, **values):
    """That of a row, as `sentence('time_limit', seconds=600)`."""
    text = SENTENCES[row]
    for name, value in values.items():
        assert f'{{{name}}}' in text, f'{row} says nothing of {name}: {text}'
        text = text.replace(f'{{{name}}}', str(value))
    assert '{' not in text, f'something is missing: {text}'
    return text


def pattern(row, **values):
    """The sentence as a regular expression: a value that is not said may be anything, and is a group of its name."""
    parts = re.split(r'\{(\w+)\}', SENTENCES[row])
    assert set(values) <= set(parts[1::2]), f'{row} says nothing of {set(values) - set(parts[1::2])}'
    names = [re.escape(str(values[name])) if name in values else f'(?P<{name}>.+)' for name in parts[1::2]]
    return ''.join(re.escape(text) + name for text, name in zip(parts[::2], [*names, '']))


def error_pattern(row, **values):
    """As a browser on /client gets it."""
    return f'^loading: Error: {pattern(row, **values)}$'


def error_line(row, **values):
    """As a browser on /client gets it."""
    return f'loading: Error: {sentence(row, **values)}'
