"""Small builders shared by the tests: vehicles, gains, flights, and laws pushed through lanes."""

import ctypes

import numpy as np
from llvmlite import binding as llvm
from llvmlite import ir

from quadstep.control.backstepping import FORCE_INPUTS, TORQUE_INPUTS, Backstepping, BacksteppingGains
from quadstep.control.nested_saturation import NestedSaturation, NestedSaturationGains
from quadstep.engines.kernel import host, verified
from quadstep.engines.loop import Loop
from quadstep.engines.scored import score_names
from quadstep.interfaces.learning import Net, random_input_weights
from quadstep.numbers import Matrix, Vector, flatten, rebuild, vector
from quadstep.program.emitter import Emitter
from quadstep.program.recorded import RecordedNumber, RecordedTable
from quadstep.vehicle.lagrange import Lagrange, Limits, Parameters
from quadstep.vehicle.paper import Disturbance, Rotors, State, Vehicle
from quadstep.world.paths import MinimumJerk, MinimumJerkParameters

METRICS = score_names(Lagrange())
"""Of the paper's plant and of real vehicles."""

CASE_1 = Loop(Lagrange(), MinimumJerk(), Backstepping())
NESTED = Loop(Lagrange(), MinimumJerk(), NestedSaturation())


def same(value):
    return vector(value, value, value)


def column(values):
    return Vector([float(value) for value in values])


def array(thing):
    """A vector or matrix of floats as a NumPy array."""
    if isinstance(thing, Matrix):
        return np.array([list(row) for row in thing])
    return np.array(list(thing))


def weight_matrix(rows):
    return Matrix([column(row) for row in rows])


def state(position=(0, 0, 0), velocity=(0, 0, 0), attitude=(0, 0, 0), rates=(0, 0, 0)):
    return State(column(position), column(velocity), column(attitude), column(rates))


def random_state(rng, tilt=1.2):
    attitude = rng.uniform((-3, -tilt, -3), (3, tilt, 3))
    return state(rng.normal(size=3), rng.normal(size=3), attitude, rng.normal(size=3))


def vehicle(inertia=(5, 5, 5), mass=1.0, gravity=9.81, rotors=None):
    return Vehicle(mass, column(inertia), gravity, rotors or Rotors(0.25, 0.02, -1e9, 1e9))


def gains(neurons=10, start=0.0, seed=1, **changes):
    """What worked in the trials of reading.md."""
    zeros = Matrix([same(0.0)] * neurons)
    force_net = Net(random_input_weights(seed, 1, neurons, FORCE_INPUTS), 5.0, 0.01)
    torque_net = Net(random_input_weights(seed, 2, neurons, TORQUE_INPUTS), 5.0, 0.01)
    result = BacksteppingGains(
        mass=1.0,
        gravity=9.81,
        slope_1=same(1.0),
        gain_1=same(3.0),
        integral_1=same(0.2),
        slope_2=same(15.0),
        gain_2=same(250.0),
        integral_2=same(10.0),
        filter_frequency=100.0,
        force_net=force_net,
        torque_net=torque_net,
        learning_start=start,
        weights_1=zeros,
        weights_2=zeros,
    )
    return result._replace(**changes)


def nested_gains(**changes):
    result = NestedSaturationGains(
        mass=1.0,
        inertia=same(5.0),
        gravity=9.81,
        altitude=vector(3.0, 0.5),
        yaw=vector(2.374, 0.08),
        bounds=vector(2.0, 1.0, 0.2, 0.1),
        slope_1=same(1.0),
        slope_2=same(15.0),
        pace=1.0,
    )
    return result._replace(**changes)


def parameters(duration=40.0, end=(20, 5, 10), **changes):
    """Case 1 of the paper, or what is left of it after `changes`."""
    path = MinimumJerkParameters(same(0.0), column(end), 0.0, 0.0, duration)
    disturbance = Disturbance(1.0, same(0.0), same(0.0))
    result = Parameters(vehicle(), disturbance, path, None, Limits(100.0, 100.0, 1.5707))._replace(**changes)
    return result if result.gains is not None else result._replace(gains=gains())


class Compiled:
    """A law over lanes, compiled once for structures like these and called with arrays of `width` numbers. table: its last
    argument.
    """

    def __init__(self, law, *likes, double=True, width=8, table=None):
        self.kind, element = (np.float64, ir.DoubleType()) if double else (np.float32, ir.FloatType())
        self.likes, self.width, align = likes, width, 8 if double else 4
        module = ir.Module("probe")
        function = ir.Function(module, ir.FunctionType(ir.VoidType(), [element.as_pointer()] * 3), "probe")
        builder = ir.IRBuilder(function.append_basic_block("entry"))
        emitter = Emitter(builder, element, width)
        source, target = (builder.bitcast(a, emitter.vector.as_pointer()) for a in function.args[:2])

        def place(base, index):
            return builder.gep(base, [ir.IntType(64)(index)])

        count = len(flatten(likes))
        lanes = rebuild(
            likes, iter([RecordedNumber(emitter, builder.load(place(source, i), align=align)) for i in range(count)])
        )
        tables = () if table is None else (RecordedTable(emitter, function.args[2], table.size),)
        self.table = np.zeros(1) if table is None else table.array.astype(self.kind)
        self.result = law(*lanes, *tables)
        for index, number in enumerate(flatten(self.result)):
            builder.store(emitter.value(number), place(target, index), align=align)
        moves = 2 + 2 * count + 2 * len(flatten(self.result))
        self.instructions = len(function.blocks[0].instructions) - moves
        builder.ret_void()
        self.call, self.engine = compiled(str(module))

    def __call__(self, *arguments):
        leaves = flatten(arguments)
        rows = np.empty((len(leaves), self.width), self.kind)
        for row, leaf in zip(rows, leaves, strict=True):
            row[:] = leaf
        answers = np.empty((len(flatten(self.result)), self.width), self.kind)
        self.call(rows.ctypes.data, answers.ctypes.data, self.table.ctypes.data)
        return rebuild(self.result, iter(answers))


def through_lanes(law, *columns, double=True, table=None, width=4):
    """What `law` gives, column by column, when it is compiled over lanes and run on columns of numbers."""

    def results(*lanes):
        found = law(*lanes)
        return tuple(found) if isinstance(found, list | tuple) else (found,)

    one = Compiled(results, *[0.0] * len(columns), double=double, width=width, table=table)
    columns = np.array([np.asarray(values, dtype=one.kind) for values in columns])
    count = columns.shape[1]
    padded = np.concatenate([columns, np.repeat(columns[:, -1:], -count % width, axis=1)], axis=1)
    answers = np.hstack([np.stack(one(*block)) for block in padded.reshape(len(columns), -1, width).transpose(1, 0, 2)])
    return answers[:, :count] if len(answers) > 1 else answers[0, :count]


def compiled(text):
    """Optimised machine code of a module with one function `probe` of three pointers."""
    cpu, features, _ = host()
    target = llvm.Target.from_default_triple().create_target_machine(cpu=cpu, features=features, opt=3, jit=True)
    engine = llvm.create_mcjit_compiler(verified(text, target), target)
    engine.finalize_object()
    kinds = [ctypes.c_void_p] * 3
    return ctypes.CFUNCTYPE(None, *kinds)(engine.get_function_address("probe")), engine
