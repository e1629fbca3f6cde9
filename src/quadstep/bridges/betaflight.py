"""Betaflight's simulator: told the state over UDP, it runs its loop once and answers with its motors.

It follows rates alone: the outer loops of `betaflight-rates` lead it with sticks. Its user starts it. It listens on every
address, so that both belong into a network namespace of their own where the machine has a network.
"""

import math
import socket
import struct
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from time import monotonic
from typing import NamedTuple

from quadstep.bridges.link import SHORTEST, WAIT, Address, ConnectionLost, SensorSample, address, datagrams
from quadstep.control.betaflight_rates import BetaflightRates
from quadstep.control.cascaded_pid import OuterMemory, asked_rates, first_memory, guided
from quadstep.control.vectoring import up_axis
from quadstep.engines.fly import FlightPlan
from quadstep.interfaces.controller import Measured
from quadstep.interfaces.plant import Model
from quadstep.io.errors import UserError
from quadstep.mission.own_controller import FIRST_WAIT
from quadstep.numbers import Vector, vector
from quadstep.numbers.rotations import rotation_matrix

PORT, CLI = 9002, 5761
"""Where its motors are sent, and where it speaks MSP and has its command line; the state is heard one port above the motors,
sticks two.
"""

STATE, STICKS, MOTORS = struct.Struct("<18d"), struct.Struct("<d16H"), struct.Struct("<4f")
"""Time, rates, specific force, attitude, velocity, position, pressure; time, channels; shares of front right, back left, front
left, back right.
"""

PLACES = 0, 3, 1, 2
"""In MOTORS, of front right, back right, back left, front left."""

NOW = 1.0
"""The time in every packet: from a time that goes on it would set the speed of its clock, which then runs away."""

NAMESPACE = "unshare -rn sh -c 'ip link set lo up; betaflight_SITL & quadstep fly ...'"
LOAD = "paste betaflight.txt into its command line and start it again (docs/autopilot.md)"


def listens_everywhere(port: int, tables: Path = Path("/proc/net")) -> bool:
    """Whether a UDP port is bound on every address of a machine that has routes; False where the system does not tell."""
    try:
        bound, routes = ((tables / one).read_text(encoding="ascii").splitlines()[1:] for one in ("udp", "route"))
    except OSError:
        return False
    return bool(routes) and any(f" 00000000:{port:04X} " in line for line in bound)


class Betaflight:
    """A link to Betaflight. Raises UserError where the port is in use or can be reached from another machine."""

    period = 0.001

    def __init__(self, where: Address, first_wait: float = FIRST_WAIT, wait: float = WAIT) -> None:
        self.where, self.first_wait, self.wait = where, first_wait, wait
        if not where.host.startswith("127."):
            raise UserError(f"{where}: Betaflight is flown on this machine alone; allowed: 127.0.0.1:PORT")
        self.socket = datagrams(where)

    def meet(self, sample: SensorSample) -> None:
        """It answers its first packet whatever its state, the next only where its motors are on."""
        until, answers = monotonic() + self.first_wait, 0
        while answers < 3:
            if listens_everywhere(self.where.port + 1):
                reach = f"Betaflight listens on every address of this machine (UDP {self.where.port + 1})"
                raise UserError(f"{reach}; run both in a network namespace: {NAMESPACE}")
            try:
                self.exchange(sample, 0.1)
                answers += 1
            except ConnectionLost:
                if monotonic() > until:
                    if answers:
                        said = f"Betaflight on {self.where} answers one packet only, so its motors are off"
                        raise UserError(f"{said}; {LOAD}") from None
                    said = f"nothing from Betaflight on {self.where} for {self.first_wait:g} s"
                    raise UserError(f"{said}; start its simulator, 4.5 or later") from None

    def exchange(self, sample: SensorSample, wait: float = 0.0) -> list[float]:
        w, x, y, z = sample.attitude
        (fx, fy, fz), nowhere = sample.force, (0.0,) * 6
        data = STATE.pack(NOW, *sample.rates, -fx, fy, fz, w, x, -y, -z, *nowhere, 101325.0)
        self.socket.sendto(data, (self.where.host, self.where.port + 1))
        self.socket.settimeout(max(wait or self.wait, SHORTEST))
        try:
            answer, _ = self.socket.recvfrom(4096)
        except (TimeoutError, ConnectionError):
            raise ConnectionLost("Betaflight stopped sending") from None
        if len(answer) != MOTORS.size:
            raise ConnectionLost(f"Betaflight sent a malformed packet of {len(answer)} bytes; its packets have {MOTORS.size}")
        shares = MOTORS.unpack(answer)
        return [shares[place] for place in PLACES]

    def close(self) -> None:
        self.socket.close()


class MspField(NamedTuple):
    """Where an answer of MSP has it: the question, and the byte."""

    question: int
    byte: int


SETTINGS = {"pid_process_denom": MspField(90, 1), "yaw_motors_reversed": MspField(42, 1)}
VERSION, RATES, ACTUAL, OLDEST = 1, 111, 3, (1, 46)
"""Questions: of the version of MSP, of rates; their type that is led; the version of Betaflight 4.5."""


def msp_answers(where: Address, questions: Iterable[int]) -> dict[int, bytes]:
    """What Betaflight answers to questions of MSP, over one connection: it closes a second one. Raises UserError."""
    try:
        with socket.create_connection(where, timeout=WAIT) as link, link.makefile("rb") as stream:
            answers = {}
            for question in questions:
                link.sendall(b"$M<" + bytes((0, question, question)))
                head = stream.read(5)
                if head[:3] != b"$M>" or head[4] != question:
                    break
                answers[question] = stream.read(head[3] + 1)[:-1]
            else:
                return answers
    except OSError as error:
        raise UserError(f"{where}: Betaflight cannot be asked for its settings: {error.strerror or error}") from None
    raise UserError(f"{where}: no Betaflight that speaks MSP")


BOOT, SWITCH, READY = 1.0, 2.0, 30.0
"""Seconds that arming waits at first, from one try to the next, and at most."""

TRIED, TRY, ASKED = 0.6, 0.1, math.radians(60.0)
"""Before lift-off: the share of the hover's speed, how long an axis is asked to turn [s], how fast [rad/s]."""

LEAD = 0.004
"""Seconds from one stick to the next."""

RISING = 1.05
"""Of the weight, until it lifts."""


class Sticks:
    """Arms Betaflight, sees whether its motors turn the vehicle as asked, lifts it, and has it follow a plan's path.

    frame: settings that it must have. shares: its last answer, in the order of the vehicle's rotors. port: of its motors.
    """

    def __init__(
        self, plan: FlightPlan, model: Model, where: Address, frame: Mapping[str, float], port: int,
        shares: Callable[[], list[float]], say: Callable[[str], None],
    ) -> None:  # fmt: skip
        self.plan, self.model, self.where, self.frame, self.shares, self.say = plan, model, where, frame, shares, say
        self.outer = BetaflightRates.gains(model).outer
        self.full = float(model.per_speed * model.fastest * model.fastest)
        self.place = where.host, port + 2
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.known, self.idle, self.armed_at, self.lifted, self.next = False, 0.0, math.nan, False, 0.0
        self.most: tuple[tuple[float, float], ...] = ()
        self.seen: dict[tuple[int, int], list[float]] = {}
        self.memory: OuterMemory | None = None

    def why(self) -> str:
        return ""

    def close(self) -> None:
        self._send(vector(0.0, 0.0, 0.0), 0.0, armed=False)
        self.socket.close()

    def stand(self, sample: SensorSample) -> str:
        """One step towards lift-off. Raises UserError where it does not arm, or would turn elsewhere."""
        time, still = sample.time, vector(0.0, 0.0, 0.0)
        if not self.known:
            self._check()
        if math.isnan(self.armed_at) and min(self.shares()) > 0.0:
            self.idle, self.armed_at = min(self.shares()), time
        if math.isnan(self.armed_at):
            if time > READY:
                raise UserError(f"Betaflight did not arm within {READY:g} s; {LOAD}")
            self._send(still, 0.0, armed=time % SWITCH > BOOT)
            return "Betaflight: not armed"
        step = int((time - self.armed_at) / TRY) - 3
        axis, part = divmod(step, 3)
        weight = float(self.outer.mass * self.outer.gravity)
        if axis < 3:
            rates = Vector(ASKED * (1, -1, 0)[part] * (place == axis and step >= 0) for place in range(3))
            self.seen[axis, part] = self.shares()
            self._send(rates, TRIED * TRIED * weight)
            return "Betaflight: motors tried"
        for one, name in enumerate(("roll right", "pitch down", "turn left")):
            change = [more - less for more, less in zip(self.seen[one, 0], self.seen[one, 1], strict=True)]
            turns = [float(sum(a * b for a, b in zip(row, change, strict=True))) for row in self.model.mixing[1:]]
            sizes = [sum(abs(float(a)) for a in row) for row in self.model.mixing[1:]]
            shares = [turn / size for turn, size in zip(turns, sizes, strict=True)]
            if not shares[one] > 2.0 * max(abs(share) for place, share in enumerate(shares) if place != one):
                raise UserError(
                    f"Betaflight, asked to {name}, changed its motors by {', '.join(f'{x:+.2f}' for x in change)}, which does "
                    f"not turn the mission's vehicle so: its mixer, motor_output_reordering or yaw_motors_reversed differ"
                )
        self._send(still, RISING * weight)
        return "Betaflight: not lifted off"

    def _check(self) -> None:
        """Reads its settings. Raises UserError for others than must be."""
        answers = msp_answers(self.where, (VERSION, RATES, *(one.question for one in SETTINGS.values())))
        version, rates = tuple(answers[VERSION][1:3]), answers[RATES]
        if version < OLDEST:
            raise UserError(f"Betaflight speaks MSP {version[0]}.{version[1]}; should be 4.5 or later, MSP 1.46")
        found = {name: answers[one.question][one.byte] for name, one in SETTINGS.items()}
        wanted = {name: round(self.frame[name]) for name in found}
        wrong = [f"{name} is {found[name]}, should be {value}" for name, value in wanted.items() if found[name] != value]
        if rates[22] != ACTUAL or rates[1] or rates[10] or rates[13]:
            wrong.append("rates_type should be ACTUAL, without expo")
        if wrong:
            raise UserError(f"Betaflight's settings do not match: {', '.join(wrong)}; {LOAD}")
        self.most = tuple((10.0 * rates[middle], 10.0 * rates[end]) for middle, end in ((0, 2), (12, 3), (11, 4)))
        self.known = True

    def fly(self, sample: SensorSample) -> None:
        """One step in the air. Raises Lost where Betaflight has disarmed."""
        if sample.time == 0.0:
            self.say(
                "Betaflight lifted off: it controls the rates, and quadstep's position and attitude loops move its sticks"
            )
            self.memory, self.next = None, 0.0
        if max(self.shares()) < 0.5 * self.idle:
            raise ConnectionLost("Betaflight disarmed")
        if sample.time < self.next - 1e-9:
            return
        self.next = sample.time + LEAD
        (px, py, pz), (vx, vy, vz), (w, x, y, z), (p, q, r) = sample.position, sample.velocity, sample.attitude, sample.rates
        attitude, zero = Vector((w, x, -y, -z)), vector(0.0, 0.0, 0.0)
        now = Measured(vector(px, -py, -pz), vector(vx, -vy, -vz), attitude, vector(p, -q, -r), 0.0, zero)
        reference = self.plan.loop.path.reference(sample.time, self.plan.parameters.path)
        self.memory = guided(self.memory or first_memory(now, self.outer), now, reference, self.outer, LEAD)
        self._send(asked_rates(self.memory, now, self.outer), float(self.memory.force @ up_axis(rotation_matrix(attitude))))

    def _send(self, rates: Vector, thrust: float, armed: bool = True) -> None:
        """Sticks for rates [rad/s] about the body's axes and a thrust [N]."""
        speed = math.sqrt(max(thrust, 0.0) / (self.model.rotors * self.full))
        throttle = min(max((speed - self.idle) / (1.0 - self.idle), 0.0), 1.0)
        roll, pitch, yaw = (self._stick(axis, math.degrees(float(one))) for axis, one in enumerate(rates))
        lift, switch = 1050 + 950 * throttle if thrust > 0.0 else 1000, 1800 if armed else 1000
        pulses = (1500 + roll, 1500 + pitch, lift, 1500 - yaw, switch)
        self.socket.sendto(STICKS.pack(NOW, *(round(one) for one in pulses), *(1000,) * 11), self.place)

    def _stick(self, axis: int, rate: float) -> float:
        """The stick [us] for a rate [deg/s]: middle x + (most - middle) x |x|."""
        if rate == 0.0 or not self.most:
            return 0.0
        middle, most = self.most[axis]
        bend, size = max(most - middle, 0.0), min(abs(rate), max(most, middle))
        x = size / middle if bend == 0.0 else (math.sqrt(middle * middle + 4.0 * bend * size) - middle) / (2.0 * bend)
        return math.copysign(500.0 * x, rate)


def console(where: str) -> Address:
    """Where its settings are asked. where: as `--pilot-connect` has it, tcp:HOST:PORT; empty: where they usually are."""
    return address(where.removeprefix("tcp:") or str(CLI), CLI)
