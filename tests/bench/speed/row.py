"""What a row of the table is."""

import dataclasses
import typing


@dataclasses.dataclass
class Row:
    work: str
    unit: str
    goal: str  # in words
    limit: float  # the figure may be as high as this
    figure: typing.Callable  # of one sample: what the goal speaks of
    setting: typing.Callable  # setting(quick): a context whose value measures one sample, a dict of who: value, ours first


def ratio(peer):
    """Ours divided by a peer's of the same sample."""
    return lambda sample: sample["ours"] / sample[peer]


def itself(sample):
    return sample["ours"]
