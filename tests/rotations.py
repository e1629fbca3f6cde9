"""Rotations from elementary ones, as a textbook has them."""

import numpy as np


def about_x(a):
    return np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])


def about_y(a):
    return np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])


def about_z(a):
    return np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])


def rotation(attitude):
    """R = Rz(psi) Ry(theta) Rx(phi), body to inertial."""
    psi, theta, phi = attitude
    return about_z(psi) @ about_y(theta) @ about_x(phi)


def papers_rotation(attitude):
    """R = Rx(-phi) Ry(-theta) Rz(-psi), whose third column is Eq. 7's direction."""
    psi, theta, phi = attitude
    return about_x(-phi) @ about_y(-theta) @ about_z(-psi)


def axis(skew):
    return np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
