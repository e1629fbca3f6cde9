"""The programs most recently compiled by this process: each holds its machine code in memory."""

from collections import OrderedDict
from collections.abc import Callable

from quadstep.engines.kernel import Kernel

MOST = 64


class Kernels(OrderedDict[object, Kernel]):
    """Kernels by a key that determines their code, the most recently used one last."""

    def get_or_make(self, key: object, make: Callable[[], Kernel]) -> Kernel:
        """The kernel of this key, made on first request; the least recently used one is dropped to make room."""
        kernel = self.pop(key, None) or make()
        self[key] = kernel
        if len(self) > MOST:
            self.popitem(last=False)
        return kernel
