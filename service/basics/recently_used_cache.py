"""A cache of the most recently used items."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from typing import TypeVar

K = TypeVar("K")
V = TypeVar("V")


class RecentItems(OrderedDict[K, V]):
    """The items that were used last, at most ``most``."""

    def __init__(self, most: int):
        super().__init__()
        self.most, self.lock = most, threading.Lock()

    def of(self, key: K, make: Callable[[], V]) -> V:
        """The item of a key. If the cache lacks the item, ``make`` creates it."""
        found = self.get(key)
        made = make() if found is None else found
        with self.lock:
            found = self.setdefault(key, made)
            self.move_to_end(key)
            while len(self) > self.most:
                self.popitem(last=False)
        return found
