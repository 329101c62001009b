// palpate_scene_set_pose of palpate.h.
#include "runtime/base/error_text.h"
#include "runtime/base/host_struct.h"
#include "runtime/scene/scene.h"

namespace palpate {
namespace {

palpate_status refuse(palpate_error* error, const char* expected, const double* found) {
  return fail(error, PALPATE_ERROR_ARGUMENT, 0, "palpate_pose: expected %s, found %g %g %g; send the last good pose",
              expected, found[0], found[1], found[2]);
}

bool is_speed(const double* v) {
  return is_finite(load3(v));
}

}  // namespace

palpate_status set_pose(const palpate_pose* pose, OrganPose* of, palpate_error* error) {
  palpate_pose wanted = palpate_default_pose();
  if (const palpate_status status = read_host_struct("pose", pose, &wanted, error)) return status;
  if (!is_position(wanted.position))
    return refuse(error, "a position within 1e6 m of the world's origin", wanted.position);
  Pose read;
  if (!read_pose(wanted.position, wanted.orientation, &read))
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "palpate_pose: expected an orientation (a quaternion w x y z) of length 1, found the length %g; divide "
                "the four numbers by their length",
                length_of(wanted.orientation));
  if (!is_speed(wanted.velocity)) return refuse(error, "a finite velocity in m/s", wanted.velocity);
  if (!is_speed(wanted.angular_velocity))
    return refuse(error, "a finite angular velocity in rad/s", wanted.angular_velocity);
  of->set(read, load3(wanted.velocity), load3(wanted.angular_velocity));
  return succeed(error);
}

}  // namespace palpate

palpate_status palpate_scene_set_pose(palpate_scene* scene, const palpate_pose* pose, palpate_error* error) {
  if (!scene || !pose) return palpate::fail(error, PALPATE_ERROR_ARGUMENT, 0, "scene and pose must not be NULL");
  return palpate::set_pose(pose, &scene->touch.organ, error);
}
