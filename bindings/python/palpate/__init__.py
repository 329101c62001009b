"""Touch an organ in real time: a tensor bundle, tools -> forces and the deformed shape.

Lengths are metres, forces newtons, times seconds; points are rows x y z. Arrays of a bundle and of contacts are views, not
copies; shapes are written into arrays of the caller's.
"""

from palpate._palpate import (
    API_VERSION,
    Bundle,
    Contacts,
    Error,
    Grip,
    Mailbox,
    PlanPass,
    Scene,
    Status,
    StepFlags,
    Tool,
    __version__,
)

__all__ = [
    "API_VERSION",
    "Bundle",
    "Contacts",
    "Error",
    "Grip",
    "Mailbox",
    "PlanPass",
    "Scene",
    "Status",
    "StepFlags",
    "Tool",
    "__version__",
]
for _each in (Bundle, Contacts, Grip, Mailbox, PlanPass, Scene, Tool):
    _each.__module__ = "palpate"
