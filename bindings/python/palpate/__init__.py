"""Touch an organ in real time: from a tensor bundle and tools to forces and the deformed shape.

Lengths are in metres, forces in newtons, times in seconds; points are rows x y z. Arrays of a bundle and of contacts are views, not
copies. A scene writes shapes into arrays of the caller.
"""

import difflib
import re

from palpate._palpate import EFFECTS as _EFFECTS
from palpate._palpate import (
    API_VERSION,
    Bundle,
    Contacts,
    Coupling,
    Device,
    DeviceFlags,
    Error,
    Grasp,
    Grip,
    Hit,
    Link,
    Mailbox,
    Needle,
    Organ,
    Passivity,
    PlanPass,
    Scene,
    Status,
    StepFlags,
    Tool,
    ToolShape,
    Watchdog,
    World,
    WorldContacts,
    WorldLink,
    __version__,
)

__all__ = [
    "API_VERSION",
    "Bundle",
    "Contacts",
    "Coupling",
    "Device",
    "DeviceFlags",
    "Error",
    "Grasp",
    "Grip",
    "Hit",
    "Link",
    "Mailbox",
    "Needle",
    "Organ",
    "Passivity",
    "PlanPass",
    "Scene",
    "Status",
    "StepFlags",
    "Tool",
    "ToolShape",
    "Watchdog",
    "World",
    "WorldContacts",
    "WorldLink",
    "__version__",
]


def _with_plain_errors(kind):
    """Has the class say which keyword it does not know, where pybind11 would print the whole signature."""
    made = kind.__init__
    signature = re.search(r"__init__\((.*)\) -> None", made.__doc__ or "")
    # The names in front of a type and a default, which have brackets, blanks and equals signs of their own.
    known = re.findall(r"(?:^|, )(\w+): ", re.sub(r"\[[^][]*\]|\([^()]*\)", "", signature[1]))[1:] if signature else []
    if signature and "**kwargs" in signature[1]:
        known += _EFFECTS

    def __init__(self, *positional, **named):
        try:
            made(self, *positional, **named)
        except TypeError as error:
            unknown = [name for name in named if name not in known]
            if not known or not str(error).startswith("__init__(): incompatible constructor arguments"):
                raise
            if unknown:
                near = difflib.get_close_matches(unknown[0], known, 1)
                said = "expected a keyword that it has, found %r%s; help(palpate.%s) lists them" % (
                    unknown[0], "; did you mean %r?" % near[0] if near else "", kind.__name__)
            else:
                said = "expected other arguments, found %s; help(palpate.%s) says which" % (
                    ", ".join([type(value).__name__ for value in positional] + ["%s: %s" % (name, type(value).__name__) for name, value in named.items()])
                    or "none", kind.__name__)
            raise TypeError("%s: %s" % (kind.__name__, said)) from None

    __init__.__doc__ = made.__doc__
    kind.__init__ = __init__


for _each in (Bundle, Contacts, Coupling, Device, Grasp, Grip, Hit, Link, Mailbox, Needle, Organ, Passivity, PlanPass, Scene, Tool, ToolShape,
              Watchdog, World, WorldContacts, WorldLink):
    _each.__module__ = "palpate"
    _with_plain_errors(_each)
