"""A stand-in for NVIDIA's driver: C functions of the same types, that run a program thread by thread on this machine."""

import ctypes
import re
import threading

import numpy as np
from llvmlite import binding as llvm

from quadstep.engines import cuda, gpu_sweep

GIVEN = ("count", "last", "step", "every", "varying", "tables", "results")
DRAWN = ("first", "count", "last", "step", "every", "tables", "results")
REGISTERS = ("ctaid", "ntid", "tid")
INVALID_VALUE, INVALID_CONTEXT, INVALID_PTX, UNKNOWN = 1, 201, 218, 999
ERRORS = {2: b"out of memory", 100: b"no CUDA-capable device is detected", 201: b"invalid device context",
          214: b"uncorrectable ECC error encountered", 218: b"a PTX JIT compilation failed",
          700: b"an illegal memory access was encountered"}  # fmt: skip


def installed(monkeypatch, **given):
    """The stand-in in place of the driver; "PTX" is then what LLVM would make it from."""
    driver = FakeDriver(**given)
    monkeypatch.setattr(cuda, "library", lambda: driver)
    monkeypatch.setattr(gpu_sweep, "assembly", lambda text, architecture: text)
    return driver


class Program:
    """A kernel of one thread, compiled for this machine; the registers that number the threads are variables."""

    def __init__(self, text):
        text = re.sub(r"target triple.*", "", text).replace("ptx_kernel ", "").replace("addrspace(4)", "")
        for name in REGISTERS:
            body = f"@r.{name} = global i32 0\ndefine i32 @{name}() {{ %v = load i32, i32* @r.{name}\n ret i32 %v }}\n"
            text = re.sub(rf'declare i32 @"llvm.nvvm.read.ptx.sreg.{name}.x"\(\)', body, text)
            text = text.replace(f'@"llvm.nvvm.read.ptx.sreg.{name}.x"', f"@{name}")
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        machine = llvm.Target.from_default_triple().create_target_machine(opt=1)
        self.engine = llvm.create_mcjit_compiler(llvm.parse_assembly(text), machine)
        self.engine.finalize_object()
        kinds = re.search(r"define void @\"sweep\"\((.*?)\)", text).group(1).split(", ")
        self.kinds = [
            ctypes.c_int64 if kind.startswith("i64 ") else ctypes.c_float if kind.startswith("float ") else
            ctypes.c_double if kind.startswith("double ") else ctypes.c_void_p
            for kind in kinds
        ]  # fmt: skip
        self.number = next(kind for kind in self.kinds if kind in (ctypes.c_float, ctypes.c_double))
        self.names = GIVEN if self.kinds[2] is self.number else DRAWN
        self.tasks = 2  # at least: control and score
        self.call = ctypes.CFUNCTYPE(None, *self.kinds)(self.engine.get_function_address("sweep"))
        size = re.search(r"constants\".*?\[(\d+) x (\w+)\]", text)
        self.constants = int(size.group(1)) * (8 if size.group(2) == "double" else 4)

    def register(self, name, value):
        ctypes.c_int32.from_address(self.engine.get_global_value_address(f"r.{name}")).value = value


class FakeDriver:
    """devices: how many there are. memory: bytes of it. slow: seconds that a flight takes.

    fail: the number of the error that a function gives. launches: flights of each, its blocks and threads. held: what was
    allocated and not given back, by address.
    """

    def __init__(self, devices=1, memory=1 << 30, slow=0.0, fail=None):
        self.devices, self.memory, self.slow, self.fail = devices, memory, slow, fail or {}
        self.calls, self.problems, self.launches, self.held, self.modules, self.events = {}, [], [], {}, {}, {}
        self.current, self.time, self.options = threading.local(), 0.0, {}
        for name, kinds in cuda.FUNCTIONS.items():
            setattr(self, name, ctypes.CFUNCTYPE(ctypes.c_int, *kinds)(self.guarded(name)))

    def guarded(self, name):
        def function(*arguments):
            self.calls[name] = self.calls.get(name, 0) + 1
            if name in self.fail:
                return self.fail[name]
            try:
                return getattr(self, f"do_{name}")(*arguments) or 0
            except Exception as error:  # it would be lost on its way through C
                self.problems.append(f"{name}: {error!r}")
                return UNKNOWN

        return function

    @property
    def stack(self):
        """The contexts of this thread."""
        if not hasattr(self.current, "stack"):
            self.current.stack = []
        return self.current.stack

    @property
    def free(self):
        return self.memory - sum(len(block) for block in self.held.values())

    def block(self, address, size):
        """The part of an allocated block; nothing else may be touched."""
        assert self.stack, "no context"
        for start, block in self.held.items():
            if start <= address and address + size <= start + len(block):
                return address
        raise AssertionError(f"{size} bytes at {address:x} are not allocated")

    def do_cuInit(self, flags):
        assert flags == 0

    def do_cuGetErrorString(self, status, text):
        text[0] = ERRORS.get(status, b"unknown error")

    def do_cuDeviceGetCount(self, count):
        count[0] = self.devices

    def do_cuDeviceGet(self, device, which):
        device[0] = which

    def do_cuDeviceGetName(self, name, size, device):
        ctypes.memmove(name, b"Stand-in\0", 9)

    def do_cuDeviceGetAttribute(self, value, which, device):
        value[0] = {13: 1_980_000, 16: 2, 39: 2048, 75: 9, 76: 0}[which]

    def do_cuDevicePrimaryCtxRetain(self, context, device):
        context[0] = 77

    def do_cuCtxPushCurrent_v2(self, context):
        self.stack.append(context)

    def do_cuCtxPopCurrent_v2(self, context):
        context[0] = self.stack.pop()

    def do_cuMemGetInfo_v2(self, free, total):
        free[0], total[0] = self.free, self.memory

    def do_cuMemAlloc_v2(self, address, size):
        assert self.stack
        if size > self.free:
            return cuda.OUT_OF_MEMORY
        block = ctypes.create_string_buffer(size)
        address[0] = ctypes.addressof(block)
        self.held[address[0]] = block
        return 0

    def do_cuMemFree_v2(self, address):
        assert self.stack
        del self.held[address]

    def do_cuMemcpyHtoD_v2(self, to, source, size):
        constants = any(to == program.engine.get_global_value_address("constants") for program in self.modules.values())
        ctypes.memmove(to if constants else self.block(to, size), source, size)

    def do_cuMemcpyDtoH_v2(self, to, source, size):
        ctypes.memmove(to, self.block(source, size), size)

    def do_cuModuleLoadDataEx(self, module, image, count, keys, values):
        self.options = {keys[i]: values[i] for i in range(count)}
        assert self.options[6] > 21  # room in the log
        text = ctypes.string_at(image).decode()
        if "define" not in text:
            ctypes.memmove(self.options[5], b"ptxas fatal\n  line 1\0", 21)
            return INVALID_PTX
        module[0] = 1000 + len(self.modules)
        self.modules[module[0]] = Program(text)
        return 0

    def do_cuModuleUnload(self, module):
        assert self.stack
        del self.modules[module]

    def do_cuModuleGetFunction(self, function, module, name):
        assert name == b"sweep"
        function[0] = module

    def do_cuModuleGetGlobal_v2(self, address, size, module, name):
        address[0], size[0] = (
            self.modules[module].engine.get_global_value_address(name.decode()),
            self.modules[module].constants,
        )

    def do_cuFuncGetAttribute(self, value, which, function):
        value[0] = {3: 16, 4: 160}[which]

    def do_cuOccupancyMaxActiveBlocksPerMultiprocessor(self, count, function, threads, shared):
        if not self.stack:
            return INVALID_CONTEXT
        count[0] = 384 // threads
        return 0

    def do_cuLaunchKernel(self, function, bx, by, bz, tx, ty, tz, shared, stream, arguments, extra):
        assert self.stack
        assert (by, bz, ty, tz, shared, stream) == (1, 1, 1, 1, 0, None)
        program = self.modules[function]
        values = [kind.from_address(arguments[i]).value for i, kind in enumerate(program.kinds)]
        given = dict(zip(program.names, values, strict=True))
        assert (bx - 1) * tx < given["count"] <= bx * tx
        assert 0 < given["last"] < 1e6
        row = given["count"] * ctypes.sizeof(program.number)
        sizes = {name: len(self.held[given[name]]) for name in ("every", "varying", "tables", "results") if name in given}
        assert sizes["every"] >= program.tasks * 8 and sizes["every"] % 8 == 0
        assert sizes["results"] > row
        assert not any(sizes[name] % row for name in ("varying", "results") if name in sizes)
        program.register("ntid", tx)
        for block, thread in np.ndindex(bx, tx):
            program.register("ctaid", block)
            program.register("tid", thread)
            program.call(*values)
        self.launches.append((given["count"], bx, tx))
        self.time += self.slow * given["count"]

    def do_cuEventCreate(self, event, flags):
        event[0] = 5000 + self.calls["cuEventCreate"]
        self.events[event[0]] = 0.0

    def do_cuEventRecord(self, event, stream):
        self.events[event] = self.time

    def do_cuEventSynchronize(self, event):
        assert event in self.events

    def do_cuEventElapsedTime(self, milliseconds, start, end):
        milliseconds[0] = 1e3 * (self.events[end] - self.events[start])

    def do_cuEventDestroy_v2(self, event):
        del self.events[event]
