"""Four rotors, one in each quarter, for laws that command rotors by their place."""

from quadstep.interfaces.model import Model
from quadstep.io.errors import UserError


def quarters(model: Model, law: str) -> tuple[tuple[int, ...], bool]:
    """The vehicle's rotors front right, back right, back left, front left, and whether the first spins clockwise, seen from
    above. law: its `type`.

    Raises UserError for a vehicle that has not one in each quarter, spinning in turn.
    """
    _, about_x, about_y, about_z = model.mixing
    places = [(-pitch, roll) for roll, pitch in zip(about_x, about_y, strict=True)]  # forward, left [m]
    corners = ((1, -1), (-1, -1), (-1, 1), (1, 1))
    found = [[i for i, (x, y) in enumerate(places) if x * front > 0.0 and y * left > 0.0] for front, left in corners]
    rotors = tuple(one[0] for one in found if len(one) == 1)
    spins = [about_z[rotor] > 0.0 for rotor in rotors]
    if len(rotors) != 4 or len(places) != 4 or spins not in ([False, True] * 2, [True, False] * 2):
        raise UserError(
            f'controller.type = "{law}": flies four rotors, one in each quarter, neighbours spinning opposite ways'
        )
    return rotors, spins[0]
