"""Waiting for the thing itself, with a deadline: the one place where tests sleep."""

import asyncio
import time

PATIENCE = 100  # seconds: only how long a broken server is waited for; removing 50,000 folders takes a busy disk a minute


def _give_up(what, patience):
    raise AssertionError(f"waited {patience} s in vain: {what() if callable(what) else what}")


def wait_until(condition, what, patience=PATIENCE):
    """Waits until `condition()` is true and returns its value; fails with `what`, a text or what makes one then, otherwise."""
    end = time.monotonic() + patience
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.02)
    _give_up(what, patience)


async def wait_until_async(condition, what, patience=PATIENCE):
    """The same of a coroutine function, where others go on meanwhile."""
    end = time.monotonic() + patience
    while time.monotonic() < end:
        value = await condition()
        if value:
            return value
        await asyncio.sleep(0.02)
    _give_up(what, patience)
