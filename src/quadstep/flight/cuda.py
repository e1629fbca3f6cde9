"""What is needed of NVIDIA's driver, and nothing else of CUDA: load PTX, move numbers, run a kernel, time it."""

import ctypes
import sys
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

LIBRARY = "nvcuda.dll" if sys.platform == "win32" else "libcuda.so.1"
LOG_SIZE = 8192

# of enum CUjit_option, CUfunction_attribute and CUdevice_attribute in cuda.h
JIT_MAX_REGISTERS, JIT_ERROR_LOG, JIT_ERROR_LOG_SIZE = 0, 5, 6
LOCAL_BYTES, REGISTERS = 3, 4
CLOCK, PROCESSORS, THREADS_A_PROCESSOR, CAPABILITY_MAJOR, CAPABILITY_MINOR = 13, 16, 39, 75, 76


class NoDeviceError(RuntimeError):
    """There is no graphics processor to fly on, and why."""


class CudaError(RuntimeError):
    """The driver refused something."""


class Device:
    """The first graphics processor of this machine, its primary context current in the thread that made this."""

    def __init__(self) -> None:
        self.driver = library()
        count = ctypes.c_int()
        try:
            self.call("cuInit", 0)
            self.call("cuDeviceGetCount", ctypes.byref(count))
        except CudaError as error:
            raise NoDeviceError(str(error)) from error
        if not count.value:
            raise NoDeviceError("the driver knows of no graphics processor")
        self.number, self.context = ctypes.c_int(), ctypes.c_void_p()
        self.call("cuDeviceGet", ctypes.byref(self.number), 0)
        self.call("cuDevicePrimaryCtxRetain", ctypes.byref(self.context), self.number)
        self.enter()
        name = ctypes.create_string_buffer(256)
        self.call("cuDeviceGetName", name, 256, self.number)
        self.name = name.value.decode()
        self.capability = 10 * self.attribute(CAPABILITY_MAJOR) + self.attribute(CAPABILITY_MINOR)

    def enter(self) -> None:
        """Make the context current in this thread."""
        self.call("cuCtxSetCurrent", self.context)

    def call(self, name: str, *arguments: Any) -> None:
        """Call a function of the driver; CudaError with its reason where it fails."""
        status = getattr(self.driver, name)(*arguments)
        if status:
            text = ctypes.c_char_p()
            self.driver.cuGetErrorString(status, ctypes.byref(text))
            raise CudaError(f"{name}: {(text.value or b'?').decode()} ({status})")

    def attribute(self, which: int) -> int:
        """A number that describes the device."""
        value = ctypes.c_int()
        self.call("cuDeviceGetAttribute", ctypes.byref(value), which, self.number)
        return value.value

    def free_memory(self) -> int:
        """Bytes."""
        free, total = ctypes.c_size_t(), ctypes.c_size_t()
        self.call("cuMemGetInfo_v2", ctypes.byref(free), ctypes.byref(total))
        return free.value


class Module:
    """PTX compiled by the driver. registers: the most that a thread may use, None for as many as it likes."""

    def __init__(self, device: Device, ptx: str, registers: int | None = None) -> None:
        self.device, self.handle = device, ctypes.c_void_p()
        log = ctypes.create_string_buffer(LOG_SIZE)
        given = {JIT_ERROR_LOG: ctypes.addressof(log), JIT_ERROR_LOG_SIZE: LOG_SIZE}
        if registers:
            given[JIT_MAX_REGISTERS] = registers
        keys = (ctypes.c_int * len(given))(*given)
        values = (ctypes.c_void_p * len(given))(*given.values())
        image = ctypes.create_string_buffer(ptx.encode())
        try:
            device.call("cuModuleLoadDataEx", ctypes.byref(self.handle), image, len(given), keys, values)
        except CudaError as error:
            raise CudaError(f"{error} {log.value.decode(errors='replace')}") from error

    def kernel(self, name: str) -> "Kernel":
        """A kernel by name."""
        function = ctypes.c_void_p()
        self.device.call("cuModuleGetFunction", ctypes.byref(function), self.handle, name.encode())
        return Kernel(self.device, function)

    def fill(self, name: str, values: NDArray[Any]) -> None:
        """Write into a variable of the module."""
        address, size = ctypes.c_uint64(), ctypes.c_size_t()
        self.device.call("cuModuleGetGlobal_v2", ctypes.byref(address), ctypes.byref(size), self.handle, name.encode())
        if values.nbytes > size.value:
            raise ValueError(f"{values.nbytes} bytes do not fit the {size.value} of {name}")
        self.device.call("cuMemcpyHtoD_v2", address, values.ctypes.data_as(ctypes.c_void_p), ctypes.c_size_t(values.nbytes))


class Kernel:
    """A kernel ready to run."""

    def __init__(self, device: Device, function: ctypes.c_void_p) -> None:
        self.device, self.function = device, function

    def attribute(self, which: int) -> int:
        """REGISTERS or LOCAL_BYTES of a thread."""
        value = ctypes.c_int()
        self.device.call("cuFuncGetAttribute", ctypes.byref(value), which, self.function)
        return value.value

    def resident_blocks(self, threads: int) -> int:
        """Blocks of so many threads that one processor holds at once."""
        count = ctypes.c_int()
        self.device.call(
            "cuOccupancyMaxActiveBlocksPerMultiprocessor", ctypes.byref(count), self.function, threads, ctypes.c_size_t(0)
        )
        return count.value

    def run(self, blocks: int, threads: int, *arguments: Any) -> float:
        """Run it to the end; the seconds it took. arguments: ctypes values."""
        addresses = (ctypes.c_void_p * len(arguments))(*(ctypes.addressof(argument) for argument in arguments))
        call, events = self.device.call, [ctypes.c_void_p(), ctypes.c_void_p()]
        for event in events:
            call("cuEventCreate", ctypes.byref(event), 0)
        call("cuEventRecord", events[0], None)
        call("cuLaunchKernel", self.function, blocks, 1, 1, threads, 1, 1, 0, None, addresses, None)
        call("cuEventRecord", events[1], None)
        call("cuEventSynchronize", events[1])
        took = ctypes.c_float()
        call("cuEventElapsedTime", ctypes.byref(took), *events)
        for event in events:
            call("cuEventDestroy_v2", event)
        return took.value / 1e3


class Memory:
    """A block of memory on the device; freed when the `with` block ends."""

    def __init__(self, device: Device, size: int) -> None:
        self.device, self.address = device, ctypes.c_uint64()
        device.call("cuMemAlloc_v2", ctypes.byref(self.address), ctypes.c_size_t(max(1, size)))

    @classmethod
    def holding(cls, device: Device, array: NDArray[Any]) -> "Memory":
        """With a copy of an array."""
        memory = cls(device, array.nbytes)
        array = np.ascontiguousarray(array)
        if array.nbytes:
            device.call(
                "cuMemcpyHtoD_v2", memory.address, array.ctypes.data_as(ctypes.c_void_p), ctypes.c_size_t(array.nbytes)
            )
        return memory

    def read(self, array: NDArray[Any]) -> None:
        """Copy into a contiguous array."""
        self.device.call("cuMemcpyDtoH_v2", array.ctypes.data_as(ctypes.c_void_p), self.address, ctypes.c_size_t(array.nbytes))

    def __enter__(self) -> "Memory":
        return self

    def __exit__(self, *_: object) -> None:
        self.device.call("cuMemFree_v2", self.address)


@lru_cache(maxsize=1)
def library() -> ctypes.CDLL:
    """The driver's library."""
    try:
        return ctypes.CDLL(LIBRARY)
    except OSError as error:
        raise NoDeviceError(f"no NVIDIA driver here ({LIBRARY} is not found)") from error
