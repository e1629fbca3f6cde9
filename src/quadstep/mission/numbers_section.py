"""Tables of a mission file that follow from a structure of declared numbers."""

from typing import Any, ClassVar

from pydantic import create_model

from quadstep.interfaces.gain import Gain, declared, gains_in
from quadstep.mission.derived import key_field
from quadstep.mission.fields import Section
from quadstep.numbers import Vector


class NumbersSection(Section):
    """Numbers that a structure declares; keys are those declared."""

    structure: ClassVar[type]

    def numbers(self) -> object:
        """The structure of these numbers."""
        values = {name: getattr(self, one.key) for name, one in gains_in(self.structure).items()}
        return self.structure(**{name: Vector(one) if isinstance(one, tuple) else one for name, one in values.items()})


def numbers_section(name: str, structure: type, base: type[NumbersSection] = NumbersSection, **more: Any) -> Any:
    """The table of a structure of declared numbers. Raises TypeError for declarations that give none."""
    fields: dict[str, Any] = {}
    for one in declared(structure).values():
        if not isinstance(one, Gain) or one.fixed is None:
            raise TypeError(f"{structure.__name__}: every number needs gain(...) with a default that is a number")
        if hasattr(base, one.key) or one.key in (*more, *base.__class_vars__):
            raise TypeError(f"{structure.__name__}: a number cannot have the key {one.key}; give it another by key=...")
        fields[one.key] = key_field(one)
    made: Any = create_model(name, __base__=base, __module__=__name__, **more, **fields)
    made.structure = structure
    return made
