"""The programs that this process has compiled, the latest only: each holds its machine code in memory."""

from collections import OrderedDict
from collections.abc import Callable

from quadstep.flight.kernel import Kernel

MOST = 64


class Kernels(OrderedDict[object, Kernel]):
    """Kernels by what decides their code, the one used last at the end."""

    def get_or_make(self, key: object, make: Callable[[], Kernel]) -> Kernel:
        """The kernel of this key, made when first asked for; the one unused for longest makes room."""
        kernel = self.pop(key, None) or make()
        self[key] = kernel
        if len(self) > MOST:
            self.popitem(last=False)
        return kernel
