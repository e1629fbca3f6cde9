"""The functions of NVIDIA's driver that are needed, and nothing else of CUDA: load PTX, copy data, run and time kernels."""

import ctypes
import sys
import weakref
from collections.abc import Callable
from ctypes import POINTER, c_char_p, c_float, c_int, c_size_t, c_uint, c_uint64, c_void_p
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadstep.io.errors import UserError

LIBRARY = "nvcuda.dll" if sys.platform == "win32" else "libcuda.so.1"

FUNCTIONS: dict[str, tuple[object, ...]] = {
    "cuInit": (c_uint,),
    "cuGetErrorString": (c_int, POINTER(c_char_p)),
    "cuDeviceGetCount": (POINTER(c_int),),
    "cuDeviceGet": (POINTER(c_int), c_int),
    "cuDeviceGetName": (c_void_p, c_int, c_int),
    "cuDeviceGetAttribute": (POINTER(c_int), c_int, c_int),
    "cuDevicePrimaryCtxRetain": (POINTER(c_void_p), c_int),
    "cuCtxPushCurrent_v2": (c_void_p,),
    "cuCtxPopCurrent_v2": (POINTER(c_void_p),),
    "cuMemGetInfo_v2": (POINTER(c_size_t), POINTER(c_size_t)),
    "cuMemAlloc_v2": (POINTER(c_uint64), c_size_t),
    "cuMemFree_v2": (c_uint64,),
    "cuMemcpyHtoD_v2": (c_uint64, c_void_p, c_size_t),
    "cuMemcpyDtoH_v2": (c_void_p, c_uint64, c_size_t),
    "cuModuleLoadDataEx": (POINTER(c_void_p), c_void_p, c_uint, POINTER(c_int), POINTER(c_void_p)),
    "cuModuleUnload": (c_void_p,),
    "cuModuleGetFunction": (POINTER(c_void_p), c_void_p, c_char_p),
    "cuModuleGetGlobal_v2": (POINTER(c_uint64), POINTER(c_size_t), c_void_p, c_char_p),
    "cuFuncGetAttribute": (POINTER(c_int), c_int, c_void_p),
    "cuOccupancyMaxActiveBlocksPerMultiprocessor": (POINTER(c_int), c_void_p, c_int, c_size_t),
    "cuLaunchKernel": (c_void_p, *[c_uint] * 7, c_void_p, POINTER(c_void_p), POINTER(c_void_p)),
    "cuEventCreate": (POINTER(c_void_p), c_uint),
    "cuEventRecord": (c_void_p, c_void_p),
    "cuEventSynchronize": (c_void_p,),
    "cuEventElapsedTime": (POINTER(c_float), c_void_p, c_void_p),
    "cuEventDestroy_v2": (c_void_p,),
}
"""As declared in cuda.h; each returns 0 or an error number."""

OUT_OF_MEMORY, UNSUPPORTED_PTX = 2, 222


class NoDeviceError(UserError):
    """There is no graphics processor to fly on; says why."""


class CudaError(UserError):
    """The driver refused a call, or a kernel failed."""


class OutOfDeviceMemoryError(CudaError):
    """The graphics processor has no memory left for this."""


@lru_cache(maxsize=1)
def library() -> ctypes.CDLL:
    """The driver's library. Raises NoDeviceError if there is none, or it is too old."""
    try:
        driver = ctypes.CDLL(LIBRARY)
    except OSError as error:
        raise NoDeviceError(f"no NVIDIA driver on this machine ({LIBRARY} not found)") from error
    for name, kinds in FUNCTIONS.items():
        try:
            getattr(driver, name).argtypes = kinds
        except AttributeError as error:
            raise NoDeviceError(f"this NVIDIA driver is too old: it has no {name}") from error
    return driver


def call(driver: ctypes.CDLL, name: str, *arguments: object) -> None:
    """Call a function of the driver; CudaError with its reason where it fails."""
    status = getattr(driver, name)(*arguments)
    if not status:
        return
    text = c_char_p()
    driver.cuGetErrorString(status, ctypes.byref(text))
    message = f"graphics processor: {name}: {(text.value or b'unknown error').decode()} ({status})"
    if status == UNSUPPORTED_PTX:
        message += "; a driver of CUDA 11.8 or later is needed"
    raise OutOfDeviceMemoryError(message) if status == OUT_OF_MEMORY else CudaError(message)


__all__ = ["CudaError", "Device", "DeviceKernel", "Memory", "Module", "NoDeviceError", "OutOfDeviceMemoryError"]

LOG_SIZE = 8192

# of enum CUjit_option, CUfunction_attribute and CUdevice_attribute in cuda.h
JIT_MAX_REGISTERS, JIT_ERROR_LOG, JIT_ERROR_LOG_SIZE = 0, 5, 6
LOCAL_BYTES, REGISTERS = 3, 4
CLOCK, PROCESSORS, THREADS_A_PROCESSOR, CAPABILITY_MAJOR, CAPABILITY_MINOR = 13, 16, 39, 75, 76


class Device:
    """The first graphics processor of this machine. Its primary context is current, in the thread, within `with device:`.

    Raises NoDeviceError where none is available.
    """

    def __init__(self) -> None:
        self.driver = library()
        count, self.number, self.context = ctypes.c_int(), ctypes.c_int(), ctypes.c_void_p()
        try:
            self.call("cuInit", 0)
            self.call("cuDeviceGetCount", ctypes.byref(count))
            if count.value:
                self.call("cuDeviceGet", ctypes.byref(self.number), 0)
                self.call("cuDevicePrimaryCtxRetain", ctypes.byref(self.context), self.number)
        except CudaError as error:
            raise NoDeviceError(str(error)) from error
        if not count.value:
            raise NoDeviceError("the NVIDIA driver finds no graphics processor")
        name = ctypes.create_string_buffer(256)
        self.call("cuDeviceGetName", name, len(name), self.number)
        self.name = name.value.decode()
        self.capability = 10 * self.attribute(CAPABILITY_MAJOR) + self.attribute(CAPABILITY_MINOR)

    def __enter__(self) -> "Device":
        self.call("cuCtxPushCurrent_v2", self.context)
        return self

    def __exit__(self, *_: object) -> None:
        self.driver.cuCtxPopCurrent_v2(ctypes.byref(ctypes.c_void_p()))

    def call(self, name: str, *arguments: object) -> None:
        call(self.driver, name, *arguments)

    def attribute(self, which: int) -> int:
        value = ctypes.c_int()
        self.call("cuDeviceGetAttribute", ctypes.byref(value), which, self.number)
        return value.value

    def free_memory(self) -> int:
        """Bytes."""
        free, total = ctypes.c_size_t(), ctypes.c_size_t()
        self.call("cuMemGetInfo_v2", ctypes.byref(free), ctypes.byref(total))
        return free.value

    def discard(self, name: str, handle: object) -> None:
        """Release something; a failure is ignored, above all after another error."""
        self.driver.cuCtxPushCurrent_v2(self.context)
        getattr(self.driver, name)(handle)
        self.driver.cuCtxPopCurrent_v2(ctypes.byref(ctypes.c_void_p()))


def discarded(owner: object, device: Device, name: str, handle: object) -> Callable[[], object]:
    """A function to release `owner`'s resource; called automatically when nothing refers to the owner any more."""
    finalizer = weakref.finalize(owner, device.discard, name, handle)
    finalizer.atexit = False  # at exit the driver cleans up itself, and may be gone already
    return finalizer


class Module:
    """PTX compiled by the driver. registers: the most that a thread may use, None for no limit."""

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
            raise type(error)(f"{error} {log.value.decode(errors='replace')}") from error
        self.close = discarded(self, device, "cuModuleUnload", self.handle)

    def kernel(self, name: str) -> "DeviceKernel":
        function = ctypes.c_void_p()
        self.device.call("cuModuleGetFunction", ctypes.byref(function), self.handle, name.encode())
        return DeviceKernel(self, function)

    def fill(self, name: str, values: NDArray[np.generic]) -> None:
        """Write into a variable of the module."""
        address, size = ctypes.c_uint64(), ctypes.c_size_t()
        self.device.call("cuModuleGetGlobal_v2", ctypes.byref(address), ctypes.byref(size), self.handle, name.encode())
        if values.nbytes > size.value:
            raise ValueError(f"{values.nbytes} bytes do not fit into the {size.value} of {name}")
        self.device.call("cuMemcpyHtoD_v2", address, values.ctypes.data, values.nbytes)


class DeviceKernel:
    def __init__(self, module: Module, function: ctypes.c_void_p) -> None:
        self.module, self.device, self.function = module, module.device, function

    def attribute(self, which: int) -> int:
        """REGISTERS or LOCAL_BYTES per thread."""
        value = ctypes.c_int()
        self.device.call("cuFuncGetAttribute", ctypes.byref(value), which, self.function)
        return value.value

    def resident_blocks(self, threads: int) -> int:
        """Blocks of this many threads that one multiprocessor holds at once."""
        count = ctypes.c_int()
        with self.device:
            self.device.call("cuOccupancyMaxActiveBlocksPerMultiprocessor", ctypes.byref(count), self.function, threads, 0)
        return count.value

    def run(self, blocks: int, threads: int, *arguments: Any) -> float:
        """Run it to the end; returns the seconds it took. arguments: ctypes values."""
        addresses = (ctypes.c_void_p * len(arguments))(*(ctypes.addressof(argument) for argument in arguments))
        call, events = self.device.call, [ctypes.c_void_p(), ctypes.c_void_p()]
        took = ctypes.c_float()
        try:
            for event in events:
                call("cuEventCreate", ctypes.byref(event), 0)
            call("cuEventRecord", events[0], None)
            call("cuLaunchKernel", self.function, blocks, 1, 1, threads, 1, 1, 0, None, addresses, None)
            call("cuEventRecord", events[1], None)
            call("cuEventSynchronize", events[1])
            call("cuEventElapsedTime", ctypes.byref(took), *events)
        finally:
            for event in events:
                if event.value:
                    self.device.discard("cuEventDestroy_v2", event)
        return took.value / 1e3


class Memory:
    """A block of memory on the device; freed when the `with` block ends, or with this object."""

    def __init__(self, device: Device, size: int) -> None:
        self.device, self.address = device, ctypes.c_uint64()
        device.call("cuMemAlloc_v2", ctypes.byref(self.address), max(1, size))
        self.free = discarded(self, device, "cuMemFree_v2", self.address)

    @classmethod
    def holding(cls, device: Device, array: NDArray[np.generic]) -> "Memory":
        memory = cls(device, array.nbytes)
        array = np.ascontiguousarray(array)
        if array.nbytes:
            device.call("cuMemcpyHtoD_v2", memory.address, array.ctypes.data, array.nbytes)
        return memory

    def read(self, array: NDArray[np.generic]) -> None:
        self.device.call("cuMemcpyDtoH_v2", array.ctypes.data, self.address, array.nbytes)

    def __enter__(self) -> "Memory":
        return self

    def __exit__(self, *_: object) -> None:
        self.free()
