/* palpate_pose.h - where the organ is in the world.
 *
 *     palpate_pose pose = palpate_default_pose();
 *     pose.position[2] = 0.1; // m
 *     pose.velocity[2] = 0.02; // m/s: it moves on by itself until the next pose
 *     palpate_scene_set_pose(scene, &pose, &error);
 *     palpate_scene_touch(scene, tools, tool_count, dt, contacts, contacts_bytes);
 *     double matrix[16]; // for a renderer
 *     palpate_pose_matrix(contacts->organ_position, contacts->organ_orientation, matrix);
 */
#ifndef PALPATE_POSE_H
#define PALPATE_POSE_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The organ's frame in the world. A point p of the organ is at position + R p, R the turn of the orientation. */
typedef struct palpate_pose {
  uint32_t struct_bytes;      /* sizeof(palpate_pose)                                                               */
  uint32_t reserved;          /* 0                                                                                  */
  double position[3];         /* default 0 m, within 1e6 m: where the origin of the organ's frame is                */
  double orientation[4];      /* default 1 0 0 0: quaternion w x y z of length 1                                    */
  double velocity[3];         /* default 0 m/s, of that origin                                                      */
  double angular_velocity[3]; /* default 0 rad/s, about the world's axes                                            */
} palpate_pose;
PALPATE_API void palpate_init_pose(palpate_pose* pose, size_t struct_bytes);
static inline palpate_pose palpate_default_pose(void) {
  palpate_pose pose;
  palpate_init_pose(&pose, sizeof pose);
  return pose;
}

/* Says where the organ is at the next touch step. Each later touch step without a new pose moves it on by its velocities times
 * the step's dt, so a host that animates the organ at 60 Hz sends the velocities too, and an organ with velocities 0 stays.
 * - Contacts depend on the motion of a tool relative to the organ alone: an organ that moves against a tool at rest is met,
 *   drags and slips like a tool that moves against an organ at rest. Between two steps the tool points move along straight
 *   lines in the organ's frame. Where the organ turns by an angle a in one step, a point at the distance r from the axis leaves
 *   its true path by r a^2 / 8.
 * - Relative motion faster than max_tool_speed is lost tracking (TRACKING_LOST), so a pose that jumps ends the contacts.
 * - palpate_scene_reset does not change the pose.
 * The organ stays in place once its velocity would take its origin beyond 1e6 m. Forces do not depend on the pose otherwise:
 * gravity does not turn against an organ with a preload.
 * An orientation whose length differs from 1 by 0.001 or less is brought to length 1; another one is refused, and so is a number
 * that is not finite: PALPATE_ERROR_ARGUMENT, and the scene keeps its pose. error may be NULL.
 * Never allocates or locks. Call it in the thread of palpate_scene_touch. */
PALPATE_API palpate_status palpate_scene_set_pose(palpate_scene* scene, const palpate_pose* pose, palpate_error* error);

/* Between the frames. position and orientation: of a palpate_pose, or organ_position and organ_orientation of a
 * palpate_contacts. The orientation counts with length 1, and as no turn where it is zero or not finite. *world and *organ may
 * be the same array. A direction, velocity or force turns with the organ; a point also moves with its position. */
PALPATE_API void palpate_point_to_world(const double position[3], const double orientation[4], const double organ[3],
                                        double world[3]);
PALPATE_API void palpate_point_to_organ(const double position[3], const double orientation[4], const double world[3],
                                        double organ[3]);
PALPATE_API void palpate_vector_to_world(const double orientation[4], const double organ[3], double world[3]);
PALPATE_API void palpate_vector_to_organ(const double orientation[4], const double world[3], double organ[3]);
/* The same as a matrix for a renderer, column after column: matrix[12 .. 14] is the position. */
PALPATE_API void palpate_pose_matrix(const double position[3], const double orientation[4], double matrix[16]);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_POSE_H */
