"""Shared by the tests of the sensors: random flights with exact rates and specific force, and laws compiled once."""

import numpy as np

from quadstep.numbers import Vector, vector
from quadstep.numbers.noise import Key, key
from quadstep.numbers.rotations import conjugate, from_yaw_pitch_roll, multiply, rotation_vector, unrotate
from quadstep.sensing.sensors import Sensors
from quadstep.vehicle.rigid_body import Motion

GRAVITY = 9.81
SENSORS = Sensors(
    gyro_noise=2e-3,
    gyro_bias=5e-3,
    gyro_walk=1e-4,
    accelerometer_noise=2e-2,
    accelerometer_bias=5e-2,
    accelerometer_walk=1e-3,
    position_noise=0.01,
    velocity_noise=0.05,
    attitude_noise=0.02,
    gravity=GRAVITY,
)
"""A cheap IMU under a camera system of ordinary quality."""

NOTHING = Vector([0.0] * 3)


def keys(seed, count, kind=np.float64):
    """The keys of `count` flights, an array a word."""
    words = np.array([list(key(seed, flight).words) for flight in range(count)], dtype=kind)
    return Key(Vector(list(words.T.copy())))


class Swinging:
    """Random flights, one an array element: coordinates and angles swing in three and two sines, about any heading."""

    def __init__(self, count, seed=5, quick=1.0, kind=np.float64):
        rng = np.random.default_rng(seed)
        self.kind = kind
        self.place = (
            rng.uniform(0.3, 1.5, (3, 3, count)),
            quick * rng.uniform(0.4, 2.5, (3, 3, count)),
            rng.uniform(0, 7, (3, 3, count)),
        )
        self.angle = (
            rng.uniform(0.1, 0.3, (3, 2, count)),
            quick * rng.uniform(0.5, 5, (3, 2, count)),
            rng.uniform(0, 7, (3, 2, count)),
        )

        self.middle = np.stack([rng.uniform(-3, 3, count), np.zeros(count), np.zeros(count)])

    def at(self, t):
        """The motion at time t and the specific force in body axes."""
        (size, frequency, phase), (swing, pace, start) = self.place, self.angle
        sine, cosine = np.sin(frequency * t + phase), np.cos(frequency * t + phase)
        acceleration = -(size * frequency**2 * sine).sum(1)
        angles, slopes = (
            self.middle + (swing * np.sin(pace * t + start)).sum(1),
            (swing * pace * np.cos(pace * t + start)).sum(1),
        )
        attitude = from_yaw_pitch_roll(Vector(angles))
        _, pitch, roll = angles
        yaw_rate, pitch_rate, roll_rate = slopes
        rates = (
            roll_rate - yaw_rate * np.sin(pitch),
            pitch_rate * np.cos(roll) + yaw_rate * np.sin(roll) * np.cos(pitch),
            -pitch_rate * np.sin(roll) + yaw_rate * np.cos(roll) * np.cos(pitch),
        )
        force = unrotate(attitude, Vector(acceleration) + vector(0.0, 0.0, GRAVITY))
        columns = (size * sine).sum(1), (size * frequency * cosine).sum(1), attitude, rates, force
        position, velocity, attitude, rates, force = (Vector([row.astype(self.kind) for row in rows]) for rows in columns)
        return Motion(position, velocity, attitude, rates), force


def stack(values):
    """Numbers of many flights as an array, shape (number, flight)."""
    return np.array(np.broadcast_arrays(*values))


def turn_between(estimate, truth):
    """The turn in world axes from an estimated attitude to the true one."""
    return rotation_vector(multiply(truth, conjugate(estimate)))


def covariance_matrix(triangle):
    """Shape (flight, 15, 15)."""
    count = len(triangle)
    entries = [triangle[min(i, j)][abs(i - j)] for i in range(count) for j in range(count)]
    return stack(entries).reshape(count, count, -1).transpose(2, 0, 1)


def errors_of(state, gyro_bias, force_bias, truth, biases):
    """What an estimate lacks to the truth, shape (15, flight); biases: of gyro and accelerometer."""
    return stack(
        [
            *(truth.position - state.position),
            *(truth.velocity - state.velocity),
            *turn_between(state.attitude, truth.attitude),
            *(biases[1] - force_bias),
            *(biases[0] - gyro_bias),
        ]
    )
