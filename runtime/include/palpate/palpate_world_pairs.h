/* palpate_world_pairs.h - organs of a world that press one another.
 *
 *     palpate_world_def def = palpate_default_world_def();
 *     def.organs = organs, def.organ_count = 2, def.max_pairs = 200, def.friction = 0.2;
 *     palpate_world_create(&def, &world, &error);
 *     palpate_world_touch(world, tools, tool_count, dt, world_contacts, world_bytes);
 *     for (int32_t p = 0; p < world_contacts->pair_count; ++p)
 *       pressure = fmax(pressure, palpate_world_contacts_pair(world_contacts, p)->pressure); // Pa
 *
 * Organs that touch (max_pairs above 0): the vertices of each organ may not pass through the surface of another one. They press without pulling, with friction where there is some, and all contacts of organs that touch, those of tools too,
 * are solved as one system.
 * - Where organs overlap as they stand when the world is created, as organs of one image do by a voxel or two, the overlap counts as
 *   touching until they part there. The log of the organ's bundle tells it, and so does palpate_world_pair.overlap.
 * - A vertex without a tensor column (a fixed one) presses the other organ like a rigid body. It may sink in by 5 % of what its own force
 *   presses, and by more near the other organ's fixed part. Where it sinks in by more than a tenth of an edge, or a fixed part of the other
 *   organ takes no force there, the step says so (NOT_TOUCHABLE).
 * - More vertices than max_pairs that are near: those that are farther away are not held (CONTACTS_DROPPED).
 * - Links and grasps of a scene hold their organ as in a scene; their rows are part of the one system. Motions move it as in a scene, and volumes
 *   are held as there.
 * - The contact nodes of pairs have the source ORGAN in the palpate_contacts of both organs.
 * - The search for pairs, their rows and the one system come on top of palpate_scene_most_operations().
 */
#ifndef PALPATE_WORLD_PAIRS_H
#define PALPATE_WORLD_PAIRS_H

#include "palpate_world.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A place where two organs touch or may touch: a vertex of one and a place on the other. */
typedef struct palpate_world_pair {
  int32_t organ[2];      /* of the vertex; of the place                                                             */
  int32_t node;          /* of organ[0]                                                                             */
  int32_t triangle;      /* of organ[1]                                                                             */
  double barycentric[3]; /* weights of the triangle's vertices                                                      */
  double place[3];       /* m, in the world: where the place on organ[1] rests                                      */
  double normal[3];      /* unit, in the world: outward from organ[1]                                               */
  double force[3];       /* N, in the world, on organ[0]; organ[1] has the opposite. Zero where they do not touch   */
  double pressure; /* Pa: the force along the normal over the vertex's share of its organ's surface; where vertices of
                            both organs press, each pair has a part of the pressure                                  */
  double gap;      /* m: between the two along the normal after this step; 0 where they press, but for rounding */
  double overlap;  /* m, by which the organs overlap there where they rest, and which counts as touching      */
} palpate_world_pair;

/* Pair 0 .. pair_count - 1, inside *contacts. */
static inline const palpate_world_pair* palpate_world_contacts_pair(const palpate_world_contacts* contacts,
                                                                    int32_t pair) {
  return (const palpate_world_pair*)(const void*)((const char*)contacts + contacts->pairs_offset +
                                                  (size_t)pair * contacts->pair_bytes);
}

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_WORLD_PAIRS_H */
