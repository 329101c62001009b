/* The offsets of the C API's struct fields in this build, by name, for the JavaScript that reads and writes them. A field that moves
 * in its header moves in this list; a field that the header renames does not compile. */
#include <palpate/palpate_complete.h>

typedef struct palpate_web_field {
  const char* name; /* NULL ends the list */
  int32_t offset;   /* bytes; for a name without a dot the size of the struct */
} palpate_web_field;

/* STRUCT(type, field, ...): the size of a struct and the offsets of up to 36 of its fields. The preprocessor expands a macro once in each
 * scan: FIELD names itself through NEXT, which the scan after it expands. */
/* clang-format off */
#define STRUCT(type, ...) {#type, sizeof(type)}, SCAN(FIELD(type, __VA_ARGS__, ))
#define FIELD(type, field, ...) {#type "." #field, offsetof(type, field)} __VA_OPT__(, NEXT BRACKETS (type, __VA_ARGS__))
#define NEXT() FIELD
#define BRACKETS ()
#define SCAN(...) SCAN3(SCAN3(SCAN3(__VA_ARGS__)))
#define SCAN3(...) SCAN2(SCAN2(SCAN2(__VA_ARGS__)))
#define SCAN2(...) SCAN1(SCAN1(SCAN1(SCAN1(__VA_ARGS__))))
#define SCAN1(...) __VA_ARGS__
/* clang-format on */

static const palpate_web_field fields[] = {
    STRUCT(palpate_error, status, byte_offset, text),
    STRUCT(palpate_bundle_info, identity, node_count, surface_node_count, triangle_count, tetrahedron_count,
           touchable_count, has_interior, has_radial, has_force, has_preload, has_large, motion_count),
    STRUCT(palpate_motion_info, kind, name),
    STRUCT(palpate_motion_state, amount, volume),
    STRUCT(palpate_load_state, force, place, displacement, area),
    STRUCT(palpate_part, effect, next),
    STRUCT(palpate_scene_def, struct_bytes, parts),
    STRUCT(palpate_key, name, effect, type, words),
    STRUCT(palpate_relaxation_def, terms, share, time),
    STRUCT(palpate_loads_def, count, centre, radius),
    STRUCT(palpate_obstacle, kind, size, friction, depth, position, orientation, positions, triangles, vertex_count,
           triangle_count),
    STRUCT(palpate_obstacles_def, count, list),
    STRUCT(palpate_obstacle_state, force, torque, position, orientation, deepest, nodes, slips),
    STRUCT(palpate_blade, points, point_count, direction, toughness, friction, width),
    STRUCT(palpate_blade_state, force, torque, work, area, in_tissue, cuts, friction_work),
    STRUCT(palpate_cut_state, surface, area, faces, removed, nodes, pieces, waiting, left, rank, is_full, rebased,
           rebasing),
    STRUCT(palpate_fine_surface, positions, triangles, vertex_count, triangle_count),
    STRUCT(palpate_render_mesh, positions, normals, vertex_count),
    STRUCT(palpate_plan_pass, name, half, sections, mapped_bytes),
    STRUCT(palpate_grip, kind, node, triangle, barycentric, displacement, axes),
    STRUCT(palpate_tool, id, points, point_count, grips, grip_count, hold, disc_radius, friction, has_torque, reference,
           organ, parts),
    STRUCT(palpate_needle, id, triangle, barycentric, tip, direction, radius, friction, cutting_force, puncture_force,
           spacing),
    STRUCT(palpate_needle_state, condition, places, slipping, force, torque, tip_force, shaft_force, depth,
           tip_at_rest),
    STRUCT(palpate_given_force, force, speed),
    STRUCT(palpate_given_force_state, condition, displacement, force, missed),
    STRUCT(palpate_grasp, id, triangle, barycentric, opposite_triangle, opposite_barycentric, position, orientation,
           radius, closing, friction, clamp_force),
    STRUCT(palpate_grasp_state, condition, force, torque, place, slipped, friction_limit),
    STRUCT(palpate_link_end, kind, triangle, barycentric, point),
    STRUCT(palpate_link, kind, id, runs_on, ends, rest_length, stiffness, breaking_force, radius),
    STRUCT(palpate_link_state, id, condition, broken, rest_length, length, tension, force, ends),
    STRUCT(palpate_contact_node, node, source, index, modified_displacement, force),
    STRUCT(palpate_tool_state, force, force_raw, torque, torque_raw, contact_count, flags),
    STRUCT(palpate_contacts, used_bytes, flags, node_count),
    STRUCT(palpate_shape_out, displacements, positions, node_capacity, node_count),
    STRUCT(palpate_skin_out, positions, normals, vertex_capacity, report, disc_normals, disc_capacity, disc_count),
    STRUCT(palpate_inside_place, tetrahedron, weight, distance),
    STRUCT(palpate_inside_out, capacity, displacements, strains, stresses, pressures, von_mises, principal),
    STRUCT(palpate_crossing, triangle, place, rest),
    STRUCT(palpate_crossings_out, capacity, count, pairs, checks, crossings),
    STRUCT(palpate_surface_hit, hit, triangle, barycentric, point, normal, distance),
    STRUCT(palpate_pose, position, orientation, velocity, angular_velocity),
    STRUCT(palpate_contact_report, struct_bytes, step, contact_count, event_count, contact_bytes, events_offset,
           event_bytes),
    STRUCT(palpate_contact, tool_id, tool, point, triangle, node, state, begun, barycentric, place, normal, depth, gap,
           force, velocity, tool_point, disc_radius, disc_normal, indentation),
    STRUCT(palpate_contact_event, kind, tool_id, point, contact, triangle, node, barycentric, place),
    STRUCT(palpate_world_organ, bundle, def, pose),
    STRUCT(palpate_world_def, organ_count, organs, force_limit, force_slew, torque_limit, torque_slew, friction,
           max_pairs, max_links),
    STRUCT(palpate_world_link, kind, id, runs_on, organ, ends, rest_length, stiffness, breaking_force, radius),
    STRUCT(palpate_world_tool_state, force, force_raw, torque, torque_raw, contact_count, flags),
    STRUCT(palpate_world_organ_state, contacts_offset, flags, near_tools, force, torque, pressed),
    STRUCT(palpate_world_pair, organ, node, triangle, barycentric, place, normal, force, pressure, gap, overlap),
    STRUCT(palpate_world_contacts, used_bytes, organs_offset, pair_bytes, pairs_offset, pair_count),
    {0, 0},
};

const palpate_web_field* palpate_web_fields(void);
const palpate_web_field* palpate_web_fields(void) {
  return fields;
}
