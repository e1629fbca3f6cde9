"""NVIDIA's driver as a C library: the functions that are called, with their types, and its message if one fails."""

import ctypes
import sys
from ctypes import POINTER, c_char_p, c_float, c_int, c_size_t, c_uint, c_uint64, c_void_p
from functools import lru_cache

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
