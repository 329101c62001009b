/* The offsets of the C API's struct fields in this build, by name, for the JavaScript that reads and writes them. A field that moves
 * in palpate.h moves in this list; a field that palpate.h renames does not compile. */
#include <palpate/palpate.h>

typedef struct palpate_web_field {
  const char* name; /* NULL ends the list */
  int32_t offset;   /* bytes; for a name without a dot the size of the struct */
} palpate_web_field;

#define SIZE(type) \
  { #type, sizeof(type) }
#define FIELD(type, field) \
  { #type "." #field, offsetof(type, field) }

static const palpate_web_field fields[] = {
    SIZE(palpate_error),
    FIELD(palpate_error, status),
    FIELD(palpate_error, byte_offset),
    FIELD(palpate_error, text),
    SIZE(palpate_bundle_info),
    FIELD(palpate_bundle_info, node_count),
    FIELD(palpate_bundle_info, surface_node_count),
    FIELD(palpate_bundle_info, triangle_count),
    FIELD(palpate_bundle_info, tetrahedron_count),
    FIELD(palpate_bundle_info, touchable_count),
    FIELD(palpate_bundle_info, has_interior),
    FIELD(palpate_bundle_info, has_radial),
    FIELD(palpate_bundle_info, has_force),
    FIELD(palpate_bundle_info, has_preload),
    SIZE(palpate_scene_def),
    FIELD(palpate_scene_def, collision),
    FIELD(palpate_scene_def, contact),
    FIELD(palpate_scene_def, law),
    FIELD(palpate_scene_def, force),
    FIELD(palpate_scene_def, shape),
    FIELD(palpate_scene_def, radial),
    FIELD(palpate_scene_def, preload),
    FIELD(palpate_scene_def, relaxation.model),
    FIELD(palpate_scene_def, relaxation.terms),
    FIELD(palpate_scene_def, relaxation.share),
    FIELD(palpate_scene_def, relaxation.time),
    FIELD(palpate_scene_def, max_tools),
    FIELD(palpate_scene_def, max_points),
    FIELD(palpate_scene_def, max_contact_nodes),
    FIELD(palpate_scene_def, force_limit),
    FIELD(palpate_scene_def, force_slew),
    FIELD(palpate_scene_def, max_tool_speed),
    FIELD(palpate_scene_def, release_distance),
    FIELD(palpate_scene_def, render_mesh),
    SIZE(palpate_render_mesh),
    FIELD(palpate_render_mesh, positions),
    FIELD(palpate_render_mesh, normals),
    FIELD(palpate_render_mesh, vertex_count),
    SIZE(palpate_plan_pass),
    FIELD(palpate_plan_pass, name),
    FIELD(palpate_plan_pass, half),
    FIELD(palpate_plan_pass, sections),
    FIELD(palpate_plan_pass, mapped_bytes),
    SIZE(palpate_grip),
    FIELD(palpate_grip, kind),
    FIELD(palpate_grip, node),
    FIELD(palpate_grip, triangle),
    FIELD(palpate_grip, barycentric),
    FIELD(palpate_grip, displacement),
    FIELD(palpate_grip, axes),
    SIZE(palpate_tool),
    FIELD(palpate_tool, id),
    FIELD(palpate_tool, points),
    FIELD(palpate_tool, point_count),
    FIELD(palpate_tool, grips),
    FIELD(palpate_tool, grip_count),
    FIELD(palpate_tool, hold),
    FIELD(palpate_tool, disc_radius),
    FIELD(palpate_tool, friction),
    SIZE(palpate_contact_node),
    FIELD(palpate_contact_node, node),
    FIELD(palpate_contact_node, tool),
    FIELD(palpate_contact_node, modified_displacement),
    FIELD(palpate_contact_node, force),
    SIZE(palpate_tool_state),
    FIELD(palpate_tool_state, force),
    FIELD(palpate_tool_state, force_raw),
    FIELD(palpate_tool_state, contact_count),
    FIELD(palpate_tool_state, flags),
    SIZE(palpate_contacts),
    FIELD(palpate_contacts, used_bytes),
    FIELD(palpate_contacts, flags),
    FIELD(palpate_contacts, node_count),
    SIZE(palpate_shape_out),
    FIELD(palpate_shape_out, displacements),
    FIELD(palpate_shape_out, positions),
    FIELD(palpate_shape_out, node_capacity),
    FIELD(palpate_shape_out, node_count),
    SIZE(palpate_skin_out),
    FIELD(palpate_skin_out, positions),
    FIELD(palpate_skin_out, normals),
    FIELD(palpate_skin_out, vertex_capacity),
    {0, 0},
};

const palpate_web_field* palpate_web_fields(void);
const palpate_web_field* palpate_web_fields(void) {
  return fields;
}
