"""A real quadrotor: a rigid body on quaternions, rotors with lag and limits, drag, ground, battery, payload, faults."""
