import enum
import os
from collections.abc import Iterable, Sequence
from typing import Any, Literal, Optional, Union

import numpy as np
import numpy.typing as npt

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

class Bundle:
    def __init__(self, path: Union[str, bytes, os.PathLike[Any]], *, access: str = ...) -> None: ...
    @staticmethod
    def from_bytes(data: Any) -> Bundle: ...
    @property
    def nodes(self) -> npt.NDArray[np.float64]: ...
    @property
    def triangles(self) -> npt.NDArray[np.int32]: ...
    @property
    def tetrahedra(self) -> npt.NDArray[np.int32]: ...
    @property
    def touchable(self) -> npt.NDArray[np.int32]: ...
    @property
    def fixed(self) -> npt.NDArray[np.uint8]: ...
    @property
    def motions(self) -> list[tuple[str, str]]: ...
    @property
    def provenance(self) -> dict[str, Any]: ...
    @property
    def node_count(self) -> int: ...
    @property
    def surface_node_count(self) -> int: ...
    @property
    def triangle_count(self) -> int: ...
    @property
    def tetrahedron_count(self) -> int: ...
    @property
    def touchable_count(self) -> int: ...
    @property
    def has_interior(self) -> bool: ...
    @property
    def has_radial(self) -> bool: ...
    @property
    def has_force(self) -> bool: ...
    @property
    def has_preload(self) -> bool: ...
    @property
    def has_large(self) -> bool: ...
    def check(self) -> None: ...
    def prefault(self, lock: bool = ...) -> None: ...

class Contacts:
    @property
    def force(self) -> npt.NDArray[np.float64]: ...
    @property
    def tools(self) -> npt.NDArray[np.void]: ...
    @property
    def nodes(self) -> npt.NDArray[np.void]: ...
    @property
    def organ_position(self) -> npt.NDArray[np.float64]: ...
    @property
    def organ_orientation(self) -> npt.NDArray[np.float64]: ...
    @property
    def data(self) -> npt.NDArray[np.uint8]: ...
    def assign(self, data: Any) -> None: ...
    @property
    def flags(self) -> StepFlags: ...
    @property
    def step(self) -> int: ...
    @property
    def sweeps(self) -> int: ...
    @property
    def newton_steps(self) -> int: ...
    @property
    def residual_displacement(self) -> float: ...
    @property
    def residual_force(self) -> float: ...

class Mailbox:
    def __init__(self, like: Contacts) -> None: ...
    def publish(self, contacts: Contacts) -> None: ...
    def newest(self, contacts: Contacts) -> bool: ...

class Grip:
    def __init__(
        self,
        *,
        node: Optional[int] = ...,
        displacement: npt.ArrayLike = ...,
        triangle: Optional[int] = ...,
        barycentric: npt.ArrayLike = ...,
        axes: int = ...,
    ) -> None: ...
    @property
    def kind(self) -> Literal["node", "surface_point"]: ...
    node: int
    triangle: int
    axes: int
    @property
    def displacement(self) -> npt.NDArray[np.float64]: ...
    @displacement.setter
    def displacement(self, to: npt.ArrayLike) -> None: ...
    @property
    def barycentric(self) -> npt.NDArray[np.float64]: ...
    @barycentric.setter
    def barycentric(self, to: npt.ArrayLike) -> None: ...

class Tool:
    def __init__(
        self,
        points: npt.ArrayLike = ...,
        *,
        grips: Iterable[Grip] = ...,
        hold: bool = ...,
        disc_radius: float = ...,
        friction: float = ...,
        id: int = ...,
        torque_about: Optional[Sequence[float]] = ...,
        grasp: Optional[Grasp] = ...,
        needle: Optional[Needle] = ...,
        organ: int = ...,
    ) -> None: ...
    @property
    def points(self) -> npt.NDArray[np.float64]: ...
    @points.setter
    def points(self, to: npt.ArrayLike) -> None: ...
    grips: list[Grip]
    hold: bool
    disc_radius: float
    friction: float
    id: int
    torque_about: Optional[Sequence[float]]
    grasp: Optional[Grasp]
    needle: Optional[Needle]
    organ: int

class Link:
    def __init__(
        self,
        kind: Literal["thread", "spring", "clip"],
        ends: Sequence[Any],
        *,
        rest_length: float = ...,
        stiffness: float = ...,
        breaking_force: float = ...,
        radius: float = ...,
        runs_on: bool = ...,
        id: int = ...,
    ) -> None: ...
    rest_length: float
    stiffness: float
    breaking_force: float
    @property
    def radius(self) -> float: ...
    runs_on: bool
    id: int

class WorldLink:
    def __init__(
        self,
        kind: Literal["thread", "spring", "clip"],
        organs: Sequence[int],
        ends: Sequence[Any],
        *,
        rest_length: float = ...,
        stiffness: float = ...,
        breaking_force: float = ...,
        radius: float = ...,
        runs_on: bool = ...,
        id: int = ...,
    ) -> None: ...
    rest_length: float
    stiffness: float
    breaking_force: float
    @property
    def radius(self) -> float: ...
    runs_on: bool
    id: int

class Grasp:
    def __init__(
        self,
        place: tuple[int, npt.ArrayLike],
        radius: float,
        position: npt.ArrayLike,
        *,
        orientation: npt.ArrayLike = ...,
        opposite: Optional[tuple[int, npt.ArrayLike]] = ...,
        closing: float = ...,
        friction: float = ...,
        clamp_force: float = ...,
        id: int = ...,
    ) -> None: ...
    @property
    def position(self) -> npt.NDArray[np.float64]: ...
    @position.setter
    def position(self, to: npt.ArrayLike) -> None: ...
    @property
    def orientation(self) -> npt.NDArray[np.float64]: ...
    @orientation.setter
    def orientation(self, to: npt.ArrayLike) -> None: ...
    closing: float
    friction: float
    clamp_force: float
    id: int

class Needle:
    def __init__(
        self,
        place: tuple[int, npt.ArrayLike],
        radius: float,
        tip: npt.ArrayLike,
        direction: npt.ArrayLike,
        *,
        friction: float = ...,
        cutting_force: float = ...,
        puncture_force: float = ...,
        spacing: float = ...,
        id: int = ...,
    ) -> None: ...
    @property
    def tip(self) -> npt.NDArray[np.float64]: ...
    @tip.setter
    def tip(self, to: npt.ArrayLike) -> None: ...
    @property
    def direction(self) -> npt.NDArray[np.float64]: ...
    @direction.setter
    def direction(self, to: npt.ArrayLike) -> None: ...
    radius: float
    friction: float
    cutting_force: float
    puncture_force: float
    spacing: float
    id: int

class ToolShape:
    def __init__(
        self,
        kind: Literal["point", "sphere", "capsule", "hull", "mesh"],
        *,
        spacing: float = ...,
        radius: float = ...,
        length: float = ...,
        vertices: npt.ArrayLike = ...,
        triangles: npt.ArrayLike = ...,
        max_points: int = ...,
    ) -> None: ...
    @property
    def points(self) -> npt.NDArray[np.float64]: ...
    @property
    def patch_radius(self) -> float: ...
    def place(self, tool: Tool, position: npt.ArrayLike, orientation: npt.ArrayLike = ...) -> None: ...

class PlanPass:
    @property
    def name(self) -> str: ...
    @property
    def half(self) -> Literal["create", "touch", "shape"]: ...
    @property
    def sections(self) -> str: ...
    @property
    def mapped_bytes(self) -> int: ...

class Hit:
    @property
    def triangle(self) -> int: ...
    @property
    def barycentric(self) -> npt.NDArray[np.float64]: ...
    @property
    def point(self) -> npt.NDArray[np.float64]: ...
    @property
    def normal(self) -> npt.NDArray[np.float64]: ...
    @property
    def distance(self) -> float: ...

class Scene:
    def __init__(
        self,
        bundle: Bundle,
        *,
        collision: Literal["off", "rest", "deformed"] = ...,
        contact: Literal["node", "triangle", "point", "patch"] = ...,
        law: Literal["sticking", "sliding", "unilateral", "coulomb"] = ...,
        force: Literal["off", "linear", "response"] = ...,
        shape: Literal["off", "surface", "volume"] = ...,
        radial: Literal["off", "response"] = ...,
        preload: Literal["off", "on"] = ...,
        queries: Literal["off", "on"] = ...,
        deformation: Literal["linear", "large", "large-beside", "large-renewed"] = ...,
        report: Literal["off", "contacts"] = ...,
        dent: Literal["off", "discs"] = ...,
        relaxation: Optional[Sequence[tuple[float, float]]] = ...,
        render_mesh: Union[npt.ArrayLike, tuple[npt.ArrayLike, npt.ArrayLike], None] = ...,
        fine_surface: Optional[tuple[npt.ArrayLike, npt.ArrayLike]] = ...,
        max_tools: int = ...,
        max_points: int = ...,
        max_contact_nodes: int = ...,
        force_limit: float = ...,
        force_slew: float = ...,
        max_tool_speed: float = ...,
        release_distance: float = ...,
        torque_limit: float = ...,
        torque_slew: float = ...,
        max_operations: int = ...,
        max_links: int = ...,
        grasps: bool = ...,
        motions: bool = ...,
        inside: bool = ...,
        needles: bool = ...,
        needle_places: int = ...,
    ) -> None: ...
    @property
    def bundle(self) -> Bundle: ...
    @property
    def shape_node_count(self) -> int: ...
    @property
    def plan(self) -> list[PlanPass]: ...
    @property
    def most_operations(self) -> int: ...
    def make_contacts(self) -> Contacts: ...
    def touch(self, tools: Iterable[Tool], dt: float, contacts: Contacts) -> StepFlags: ...
    def deform(self) -> int: ...
    def shape(
        self,
        contacts: Contacts,
        positions: Optional[npt.NDArray[np.float32]] = ...,
        displacements: Optional[npt.NDArray[np.float32]] = ...,
    ) -> StepFlags: ...
    @property
    def vertex_count(self) -> int: ...
    def skin(
        self,
        displacements: npt.NDArray[np.float32],
        positions: Optional[npt.NDArray[np.float32]] = ...,
        normals: Optional[npt.NDArray[np.float32]] = ...,
        report: Optional[bytes] = ...,
        disc_normals: Optional[npt.NDArray[np.float32]] = ...,
    ) -> StepFlags: ...
    def normals(self, positions: npt.NDArray[np.float32], normals: npt.NDArray[np.float32]) -> StepFlags: ...
    def locate(self, points: npt.ArrayLike, farthest: float = ...) -> npt.NDArray[np.void]: ...
    def inside(
        self,
        displacements: npt.NDArray[np.float32],
        strains: Optional[npt.NDArray[np.float32]] = ...,
        stresses: Optional[npt.NDArray[np.float32]] = ...,
        pressures: Optional[npt.NDArray[np.float32]] = ...,
        von_mises: Optional[npt.NDArray[np.float32]] = ...,
        principal: Optional[npt.NDArray[np.float32]] = ...,
    ) -> StepFlags: ...
    def inside_at(
        self,
        places: npt.NDArray[np.void],
        displacements: Optional[npt.NDArray[np.float32]] = ...,
        strains: Optional[npt.NDArray[np.float32]] = ...,
        stresses: Optional[npt.NDArray[np.float32]] = ...,
        pressures: Optional[npt.NDArray[np.float32]] = ...,
        von_mises: Optional[npt.NDArray[np.float32]] = ...,
        principal: Optional[npt.NDArray[np.float32]] = ...,
    ) -> StepFlags: ...
    def carry(
        self,
        positions: npt.NDArray[np.float32],
        places: npt.NDArray[np.void],
        moved: npt.NDArray[np.float32],
    ) -> StepFlags: ...
    def cast_ray(
        self,
        origin: npt.ArrayLike,
        direction: npt.ArrayLike,
        contacts: Optional[Contacts] = ...,
        longest: float = ...,
    ) -> Optional[Hit]: ...
    def closest_point(
        self, point: npt.ArrayLike, contacts: Optional[Contacts] = ..., farthest: float = ...
    ) -> Optional[Hit]: ...
    def report_bytes(self) -> bytes: ...
    def report(self) -> tuple[npt.NDArray[np.void], npt.NDArray[np.void]]: ...
    def signed_distance(self, point: npt.ArrayLike, contacts: Optional[Contacts] = ...) -> float: ...
    def set_pose(
        self,
        position: npt.ArrayLike = ...,
        orientation: npt.ArrayLike = ...,
        *,
        velocity: npt.ArrayLike = ...,
        angular_velocity: npt.ArrayLike = ...,
    ) -> None: ...
    def set_motions(self, amounts: npt.ArrayLike) -> None: ...
    def hold_volume(self, motion: int, volume: Optional[float]) -> None: ...
    def motion_states(self) -> npt.NDArray[np.void]: ...
    def set_links(self, links: Iterable[Link]) -> None: ...
    def link_states(self) -> npt.NDArray[np.void]: ...
    def grasp_state(self, id: int) -> Optional[np.void]: ...
    def needle_state(self, id: int) -> Optional[np.void]: ...
    def reset(self) -> None: ...
    def reset_tool(self, id: int) -> None: ...
    def save(self) -> bytes: ...
    def restore(self, state: Any) -> None: ...

class Organ:
    def __init__(
        self,
        bundle: Bundle,
        *,
        collision: Literal["off", "rest", "deformed"] = ...,
        contact: Literal["node", "triangle", "point", "patch"] = ...,
        law: Literal["sticking", "sliding", "unilateral", "coulomb"] = ...,
        force: Literal["off", "linear", "response"] = ...,
        shape: Literal["off", "surface", "volume"] = ...,
        radial: Literal["off", "response"] = ...,
        preload: Literal["off", "on"] = ...,
        queries: Literal["off", "on"] = ...,
        deformation: Literal["linear", "large", "large-beside", "large-renewed"] = ...,
        report: Literal["off", "contacts"] = ...,
        dent: Literal["off", "discs"] = ...,
        relaxation: Optional[Sequence[tuple[float, float]]] = ...,
        render_mesh: Union[npt.ArrayLike, tuple[npt.ArrayLike, npt.ArrayLike], None] = ...,
        fine_surface: Optional[tuple[npt.ArrayLike, npt.ArrayLike]] = ...,
        max_tools: int = ...,
        max_points: int = ...,
        max_contact_nodes: int = ...,
        force_limit: float = ...,
        force_slew: float = ...,
        max_tool_speed: float = ...,
        release_distance: float = ...,
        torque_limit: float = ...,
        torque_slew: float = ...,
        max_operations: int = ...,
        max_links: int = ...,
        grasps: bool = ...,
        motions: bool = ...,
        inside: bool = ...,
        needles: bool = ...,
        needle_places: int = ...,
    ) -> None: ...
    @property
    def position(self) -> npt.NDArray[np.float64]: ...
    @position.setter
    def position(self, to: npt.ArrayLike) -> None: ...
    @property
    def orientation(self) -> npt.NDArray[np.float64]: ...
    @orientation.setter
    def orientation(self, to: npt.ArrayLike) -> None: ...

class World:
    def __init__(
        self,
        organs: Sequence[Organ],
        *,
        friction: float = ...,
        max_pairs: int = ...,
        force_limit: float = ...,
        force_slew: float = ...,
        torque_limit: float = ...,
        torque_slew: float = ...,
        max_links: int = ...,
    ) -> None: ...
    @property
    def scenes(self) -> list[Scene]: ...
    def make_contacts(self) -> WorldContacts: ...
    def touch(self, tools: Iterable[Tool], dt: float, contacts: WorldContacts) -> StepFlags: ...
    def set_links(self, links: Iterable[WorldLink]) -> None: ...
    def link_states(self) -> npt.NDArray[np.void]: ...
    def reset(self) -> None: ...
    def reset_tool(self, id: int) -> None: ...
    def save(self) -> bytes: ...
    def restore(self, state: Any) -> None: ...

class WorldContacts:
    @property
    def force(self) -> npt.NDArray[np.float64]: ...
    @property
    def tools(self) -> npt.NDArray[np.void]: ...
    @property
    def organ_states(self) -> npt.NDArray[np.void]: ...
    @property
    def pairs(self) -> npt.NDArray[np.void]: ...
    @property
    def organs(self) -> list[Contacts]: ...
    @property
    def flags(self) -> StepFlags: ...
    @property
    def step(self) -> int: ...

class DeviceFlags(enum.IntFlag):
    BAD_INPUT = 1
    FORCE_LIMITED = 2
    VELOCITY_LIMITED = 4
    ACTIVE = 8
    SILENT = 16

class Device:
    def __init__(
        self,
        *,
        mass: float,
        damping: float,
        tick: float = ...,
        delay_ticks: int = ...,
        force_limit: float = ...,
        velocity_limit: float = ...,
    ) -> None: ...
    mass: float
    damping: float
    tick: float
    delay_ticks: int
    force_limit: float
    velocity_limit: float

class Coupling:
    def __init__(
        self,
        device: Device,
        *,
        stiffness: Optional[float] = ...,
        damping: Optional[float] = ...,
        tool_mass: Optional[float] = ...,
    ) -> None: ...
    def step(self, device_position: npt.ArrayLike, organ_force: npt.ArrayLike) -> DeviceFlags: ...
    def reset(self) -> None: ...
    @staticmethod
    def required_damping(stiffness: float, damping: float, tick: float, delay_ticks: int) -> float: ...
    @property
    def tool_position(self) -> npt.NDArray[np.float64]: ...
    @property
    def tool_velocity(self) -> npt.NDArray[np.float64]: ...
    @property
    def device_force(self) -> npt.NDArray[np.float64]: ...
    @property
    def organ_damping(self) -> float: ...
    @property
    def energy(self) -> float: ...
    @property
    def stiffness(self) -> float: ...
    @property
    def damping(self) -> float: ...
    @property
    def tool_mass(self) -> float: ...

class Passivity:
    def __init__(self, device: Device, *, rest_force: float = ..., tolerance: float = ..., controller: float = ...) -> None: ...
    def step(self, device_position: npt.ArrayLike, force: npt.ArrayLike, stored_energy: float = ...) -> DeviceFlags: ...
    @property
    def device_force(self) -> npt.NDArray[np.float64]: ...
    @property
    def energy(self) -> float: ...
    @property
    def generated(self) -> float: ...
    @property
    def injected(self) -> float: ...

class Watchdog:
    def __init__(self, *, timeout: float = ..., fade: float = ..., slew: float = ...) -> None: ...
    def step(self, sequence: int, force: npt.ArrayLike, dt: float) -> DeviceFlags: ...
    @property
    def device_force(self) -> npt.NDArray[np.float64]: ...
    @property
    def age(self) -> float: ...
