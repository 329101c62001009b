import enum
import os
from collections.abc import Iterable, Sequence
from typing import Any, Final, Literal, Optional, TypedDict, Union

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike
from typing_extensions import Unpack

_Doubles = npt.NDArray[np.float64]
_Records = npt.NDArray[np.void]
_Filled = npt.NDArray[np.float32]  # the caller's, which the call fills or reads
_Out = Optional[_Filled]
_Place = tuple[int, ArrayLike]
_Word = Literal["foremost", "hindmost", "leftmost", "rightmost", "uppermost", "lowest"]

class _Numbers:
    """A property that is read as an array, a view, and set from anything like one."""
    def __get__(self, of: Any, type: Any = ...) -> _Doubles: ...
    def __set__(self, of: Any, to: ArrayLike) -> None: ...

__version__: str
API_VERSION: int

class Status(enum.IntEnum):
    OK = 0
    TRUNCATED = 1
    MAGIC = 2
    VERSION = 3
    SECTION = 4
    CHECKSUM = 5
    CONTENT = 6
    ARGUMENT = 7
    MEMORY = 8
    FILE = 9
    EFFECT = 10
    LOCK = 11

class Error(RuntimeError):
    text: str
    status: Status
    byte_offset: int

class StepFlags(enum.IntFlag):
    BAD_INPUT = 1
    CONTACTS_DROPPED = 2
    REGULARISED = 4
    RESPONSE_RANGE = 8
    FORCE_LIMITED = 16
    BUNDLE_LOST = 32
    NOT_TOUCHABLE = 64
    UNSOLVED = 128
    OTHER_BUNDLE = 256
    TRACKING_LOST = 512
    WORK_DEFERRED = 1024
    SOLVE_INEXACT = 2048
    DISCS_THINNED = 4096
    DEFORMATION_BEHIND = 8192
    LINK_BROKE = 16384
    MOTION_LIMITED = 32768
    FRICTION_JAMS = 65536
    SURFACE_CROSSES = 131072

class Bundle:
    def __init__(self, path: Union[str, bytes, os.PathLike[Any]], *, access: str = ...) -> None: ...
    @staticmethod
    def from_bytes(data: Any) -> Bundle: ...
    nodes: Final[_Doubles]
    triangles: Final[npt.NDArray[np.int32]]
    tetrahedra: Final[npt.NDArray[np.int32]]
    touchable: Final[npt.NDArray[np.int32]]
    fixed: Final[npt.NDArray[np.uint8]]
    motions: Final[list[tuple[str, str]]]
    provenance: Final[dict[str, Any]]
    frame: Final[Literal["LPS", "RAS", "none"]]
    def place(self, at: _Word) -> Place: ...
    node_count: Final[int]
    surface_node_count: Final[int]
    triangle_count: Final[int]
    tetrahedron_count: Final[int]
    touchable_count: Final[int]
    has_interior: Final[bool]
    has_radial: Final[bool]
    has_force: Final[bool]
    has_preload: Final[bool]
    has_large: Final[bool]
    def check(self) -> None: ...
    def prefault(self, lock: bool = ...) -> None: ...

class Place:
    def __init__(self, point: _Doubles, normal: _Doubles) -> None: ...
    point: Final[_Doubles]
    normal: Final[_Doubles]
    def under(self, depth: float) -> _Doubles: ...

class Contacts:
    force: Final[_Doubles]
    tools: Final[_Records]
    nodes: Final[_Records]
    organ_position: Final[_Doubles]
    organ_orientation: Final[_Doubles]
    data: Final[npt.NDArray[np.uint8]]
    def assign(self, data: Any) -> None: ...
    flags: Final[StepFlags]
    step: Final[int]
    sweeps: Final[int]
    newton_steps: Final[int]
    residual_displacement: Final[float]
    residual_force: Final[float]

class Mailbox:
    def __init__(self, like: Contacts) -> None: ...
    def publish(self, contacts: Contacts) -> None: ...
    def newest(self, contacts: Contacts) -> bool: ...

class Grip:
    def __init__(
        self, *, node: Optional[int] = ..., displacement: ArrayLike = ..., triangle: Optional[int] = ..., barycentric: ArrayLike = ...,
        axes: int = ...
    ) -> None: ...
    kind: Final[Literal["node", "surface_point"]]
    node: int
    triangle: int
    axes: int
    displacement: _Numbers
    barycentric: _Numbers

class Tool:
    def __init__(
        self, points: ArrayLike = ..., *, grips: Iterable[Grip] = ..., hold: bool = ..., disc_radius: float = ..., friction: float = ...,
        id: int = ..., torque_about: Optional[Sequence[float]] = ..., grasp: Optional[Grasp] = ..., needle: Optional[Needle] = ...,
        given_force: Optional[GivenForce] = ..., organ: int = ...
    ) -> None: ...
    points: _Numbers
    grips: list[Grip]
    hold: bool
    disc_radius: float
    friction: float
    id: int
    torque_about: Optional[Sequence[float]]
    grasp: Optional[Grasp]
    needle: Optional[Needle]
    given_force: Optional[GivenForce]
    organ: int

class GivenForce:
    def __init__(self, force: ArrayLike, *, speed: float = ...) -> None: ...
    force: _Numbers
    speed: float

class Obstacle:
    def __init__(
        self, kind: Literal["rectangle", "disc", "mesh"], size: Union[None, float, Sequence[float]] = ..., *,
        mesh: Optional[tuple[ArrayLike, ArrayLike]] = ..., friction: float = ..., depth: float = ..., position: ArrayLike = ...,
        orientation: ArrayLike = ...
    ) -> None: ...

class Link:
    def __init__(
        self, kind: Literal["thread", "spring", "clip"], ends: Sequence[Any], *, rest_length: float = ..., stiffness: float = ...,
        breaking_force: float = ..., radius: float = ..., runs_on: bool = ..., id: int = ...
    ) -> None: ...
    rest_length: float
    stiffness: float
    breaking_force: float
    radius: Final[float]
    runs_on: bool
    id: int

class WorldLink:
    def __init__(
        self, kind: Literal["thread", "spring", "clip"], organs: Sequence[int], ends: Sequence[Any], *, rest_length: float = ...,
        stiffness: float = ..., breaking_force: float = ..., radius: float = ..., runs_on: bool = ..., id: int = ...
    ) -> None: ...
    rest_length: float
    stiffness: float
    breaking_force: float
    radius: Final[float]
    runs_on: bool
    id: int

class Grasp:
    def __init__(
        self, place: _Place, radius: float, position: ArrayLike, *, orientation: ArrayLike = ..., opposite: Optional[_Place] = ...,
        closing: float = ..., friction: float = ..., clamp_force: float = ..., id: int = ...
    ) -> None: ...
    position: _Numbers
    orientation: _Numbers
    closing: float
    friction: float
    clamp_force: float
    id: int

class Needle:
    def __init__(
        self, place: _Place, radius: float, tip: ArrayLike, direction: ArrayLike, *, friction: float = ..., cutting_force: float = ...,
        puncture_force: float = ..., spacing: float = ..., id: int = ...
    ) -> None: ...
    tip: _Numbers
    direction: _Numbers
    radius: float
    friction: float
    cutting_force: float
    puncture_force: float
    spacing: float
    id: int

class ToolShape:
    def __init__(
        self, kind: Literal["point", "sphere", "capsule", "hull", "mesh"], *, spacing: float = ..., radius: float = ...,
        length: float = ..., vertices: ArrayLike = ..., triangles: ArrayLike = ..., max_points: int = ...
    ) -> None: ...
    points: Final[_Doubles]
    patch_radius: Final[float]
    def place(self, tool: Tool, position: ArrayLike, orientation: ArrayLike = ...) -> None: ...

class PlanPass:
    name: Final[str]
    half: Final[Literal["create", "touch", "shape"]]
    sections: Final[str]
    mapped_bytes: Final[int]
    memory_bytes: Final[int]

class Hit:
    triangle: Final[int]
    barycentric: Final[_Doubles]
    point: Final[_Doubles]
    normal: Final[_Doubles]
    distance: Final[float]

class _Effects(TypedDict, total=False):
    # Printed from palpate_scene_key():
    collision: Literal["off", "rest", "deformed"]
    contact: Literal["node", "triangle", "point", "patch"]
    law: Literal["sticking", "sliding", "unilateral", "coulomb"]
    force: Literal["off", "linear", "response"]
    shape: Literal["off", "surface", "volume"]
    radial: Literal["off", "response"]
    preload: Union[bool, Literal["off", "on"]]
    max_tools: int
    max_points: int
    max_contact_nodes: int
    max_operations: int
    force_limit: float
    force_slew: float
    torque_limit: float
    torque_slew: float
    max_tool_speed: float
    release_distance: float
    deformation: Literal["linear", "large", "large-beside", "large-renewed", "large-auto"]
    grasps: bool
    needles: bool
    needle_places: int
    motions: bool
    max_links: int
    report: Literal["off", "contacts"]
    queries: Union[bool, Literal["off", "on"]]
    dent: Literal["off", "discs"]
    inside: Union[bool, Literal["off", "on"]]
    force_control: bool
    obstacle_nodes: int
    crossings: Union[bool, Literal["off", "on"]]
    crossings_calls: int
    crossings_operations: int
    cut: Union[bool, Literal["off", "on"]]
    cut_nodes: int
    cut_rank: int
    cut_operations: int
    cut_points: int
    cut_lips: int
    cut_rebase: int
    # (end of what is printed)
    relaxation: Optional[Sequence[tuple[float, float]]]
    loads: Optional[Sequence[tuple[Sequence[float], float]]]
    obstacles: Optional[Iterable[Obstacle]]
    render_mesh: Union[ArrayLike, tuple[ArrayLike, ArrayLike], None]
    fine_surface: Optional[tuple[ArrayLike, ArrayLike]]

class Scene:
    def __init__(self, bundle: Bundle, **effects: Unpack[_Effects]) -> None: ...
    bundle: Final[Bundle]
    shape_node_count: Final[int]
    plan: Final[list[PlanPass]]
    most_operations: Final[int]
    def explain(self) -> str: ...
    def plot_press(
        self, at: Union[_Word, Place], depth: float, file: Union[None, str, os.PathLike[Any]] = ..., disc_radius: float = ..., speed: float = ...
    ) -> tuple[_Doubles, _Doubles]: ...
    def make_contacts(self) -> Contacts: ...
    def touch(self, tools: Iterable[Tool], dt: float, contacts: Contacts) -> StepFlags: ...
    def deform(self) -> int: ...
    def shape(self, contacts: Contacts, positions: _Out = ..., displacements: _Out = ...) -> StepFlags: ...
    vertex_count: Final[int]
    def skin(
        self, displacements: _Filled, positions: _Out = ..., normals: _Out = ..., report: Optional[bytes] = ..., disc_normals: _Out = ...
    ) -> StepFlags: ...
    def normals(self, positions: _Filled, normals: _Filled) -> StepFlags: ...
    def locate(self, points: ArrayLike, farthest: float = ...) -> _Records: ...
    def inside(
        self, displacements: _Filled, strains: _Out = ..., stresses: _Out = ..., pressures: _Out = ..., von_mises: _Out = ...,
        principal: _Out = ...
    ) -> StepFlags: ...
    def inside_at(
        self, places: _Records, displacements: _Out = ..., strains: _Out = ..., stresses: _Out = ..., pressures: _Out = ...,
        von_mises: _Out = ..., principal: _Out = ...
    ) -> StepFlags: ...
    def carry(self, positions: _Filled, places: _Records, moved: _Filled) -> StepFlags: ...
    def crossings(self, positions: _Filled) -> tuple[StepFlags, int, int, _Records]: ...
    def cast_ray(
        self, origin: ArrayLike, direction: ArrayLike, contacts: Optional[Contacts] = ..., longest: float = ...
    ) -> Optional[Hit]: ...
    def closest_point(self, point: ArrayLike, contacts: Optional[Contacts] = ..., farthest: float = ...) -> Optional[Hit]: ...
    def report_bytes(self) -> bytes: ...
    def report(self) -> tuple[_Records, _Records]: ...
    def signed_distance(self, point: ArrayLike, contacts: Optional[Contacts] = ...) -> float: ...
    def set_pose(
        self, position: ArrayLike = ..., orientation: ArrayLike = ..., *, velocity: ArrayLike = ..., angular_velocity: ArrayLike = ...
    ) -> None: ...
    def set_motions(self, amounts: ArrayLike) -> None: ...
    def hold_volume(self, motion: int, volume: Optional[float]) -> None: ...
    def motion_states(self) -> _Records: ...
    def set_load(self, load: int, vector: ArrayLike, *, per_area: bool = ..., in_world: bool = ...) -> None: ...
    def load_states(self) -> _Records: ...
    def set_obstacle_pose(
        self, obstacle: int, position: ArrayLike = ..., orientation: ArrayLike = ..., *, velocity: ArrayLike = ...,
        angular_velocity: ArrayLike = ...
    ) -> None: ...
    def obstacle_states(self) -> _Records: ...
    def set_blade(
        self, blade: int, points: ArrayLike, direction: Optional[ArrayLike] = ..., toughness: float = ..., *, friction: float = ...,
        width: float = ...
    ) -> None: ...
    def withdraw_blade(self, blade: int) -> None: ...
    def blade_state(self, blade: int) -> Optional[np.void]: ...
    def remove_tissue(self, centre: ArrayLike, radius: float, *, held: float = ..., needed: float = ...) -> None: ...
    def cut_state(self) -> Optional[np.void]: ...
    def cut_surface(self) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.bool_]]: ...
    def set_links(self, links: Iterable[Link]) -> None: ...
    def link_states(self) -> _Records: ...
    def given_force_state(self, id: int) -> Optional[np.void]: ...
    def grasp_state(self, id: int) -> Optional[np.void]: ...
    def needle_state(self, id: int) -> Optional[np.void]: ...
    def reset(self) -> None: ...
    def reset_tool(self, id: int) -> None: ...
    def save(self) -> bytes: ...
    def restore(self, state: Any) -> None: ...

class Organ:
    def __init__(self, bundle: Bundle, **effects: Unpack[_Effects]) -> None: ...
    position: _Numbers
    orientation: _Numbers

class World:
    def __init__(
        self, organs: Sequence[Organ], *, friction: float = ..., max_pairs: int = ..., force_limit: float = ..., force_slew: float = ...,
        torque_limit: float = ..., torque_slew: float = ..., max_links: int = ...
    ) -> None: ...
    scenes: Final[list[Scene]]
    def make_contacts(self) -> WorldContacts: ...
    def touch(self, tools: Iterable[Tool], dt: float, contacts: WorldContacts) -> StepFlags: ...
    def set_links(self, links: Iterable[WorldLink]) -> None: ...
    def link_states(self) -> _Records: ...
    def reset(self) -> None: ...
    def reset_tool(self, id: int) -> None: ...
    def save(self) -> bytes: ...
    def restore(self, state: Any) -> None: ...

class WorldContacts:
    force: Final[_Doubles]
    tools: Final[_Records]
    organ_states: Final[_Records]
    pairs: Final[_Records]
    organs: Final[list[Contacts]]
    flags: Final[StepFlags]
    step: Final[int]

class DeviceFlags(enum.IntFlag):
    BAD_INPUT = 1
    FORCE_LIMITED = 2
    VELOCITY_LIMITED = 4
    ACTIVE = 8
    SILENT = 16

class Device:
    def __init__(
        self, *, mass: float, damping: float, tick: float = ..., delay_ticks: int = ..., force_limit: float = ...,
        velocity_limit: float = ...
    ) -> None: ...
    mass: float
    damping: float
    tick: float
    delay_ticks: int
    force_limit: float
    velocity_limit: float

class Coupling:
    def __init__(
        self, device: Device, *, stiffness: Optional[float] = ..., damping: Optional[float] = ..., tool_mass: Optional[float] = ...
    ) -> None: ...
    def step(self, device_position: ArrayLike, organ_force: ArrayLike) -> DeviceFlags: ...
    def reset(self) -> None: ...
    @staticmethod
    def required_damping(stiffness: float, damping: float, tick: float, delay_ticks: int) -> float: ...
    tool_position: Final[_Doubles]
    tool_velocity: Final[_Doubles]
    device_force: Final[_Doubles]
    organ_damping: Final[float]
    energy: Final[float]
    stiffness: Final[float]
    damping: Final[float]
    tool_mass: Final[float]

class Passivity:
    def __init__(self, device: Device, *, rest_force: float = ..., tolerance: float = ..., controller: float = ...) -> None: ...
    def step(self, device_position: ArrayLike, force: ArrayLike, stored_energy: float = ...) -> DeviceFlags: ...
    device_force: Final[_Doubles]
    energy: Final[float]
    generated: Final[float]
    injected: Final[float]

class Watchdog:
    def __init__(self, *, timeout: float = ..., fade: float = ..., slew: float = ...) -> None: ...
    def step(self, sequence: int, force: ArrayLike, dt: float) -> DeviceFlags: ...
    device_force: Final[_Doubles]
    age: Final[float]
