"""Touch an organ in real time: from a tensor bundle and tools to forces and the deformed shape.

Lengths are in metres, forces in newtons, times in seconds; points are rows x y z. Arrays of a bundle and of contacts are views, not
copies. A scene writes shapes into arrays of the caller.
"""

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
for _each in (Bundle, Contacts, Coupling, Device, Grasp, Grip, Hit, Link, Mailbox, Needle, Organ, Passivity, PlanPass, Scene, Tool, Watchdog, World, WorldContacts, WorldLink):
    _each.__module__ = "palpate"
