/* palpate_keys.h - the fields of palpate_scene_def and of its parts by their names.
 *
 *     palpate_scene_def def = palpate_default_scene_def();
 *     palpate_add_all_parts(&def, malloc(palpate_all_parts_bytes()));
 *     for (int32_t k = 0; palpate_scene_key(k); ++k)
 *       if (strcmp(palpate_scene_key(k)->name, "force_limit") == 0)
 *         palpate_set_key(palpate_scene_key(k), &def, 20); // N
 */
#ifndef PALPATE_KEYS_H
#define PALPATE_KEYS_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The fields of palpate_scene_def and of the structs of all effects, for hosts that give them by their names: bindings, readers of files,
 * forms. */
typedef enum palpate_key_type {
  PALPATE_KEY_CHOICE, /* an enum: the index of one of `words`                              */
  PALPATE_KEY_FLAG,   /* int32_t: 0 or 1                                                   */
  PALPATE_KEY_COUNT,  /* a whole number: int32_t, or int64_t where it has 8 bytes          */
  PALPATE_KEY_NUMBER, /* double; an array of them where it has more than 8 bytes           */
  PALPATE_KEY_POINTER /* the host's, or NULL; the allocator begins with one                */
} palpate_key_type;
typedef struct palpate_key {
  const char* name;             /* "force_limit", "relaxation.share"                              */
  const palpate_effect* effect; /* in whose struct the field is; NULL: in palpate_scene_def       */
  int32_t offset, bytes;        /* of the field, in that struct of this library                   */
  palpate_key_type type;
  const char* unit;   /* "N"; "" where it has none                                         */
  const char* words;  /* of a CHOICE "off, rest, deformed"; else what 0 stands for, or ""  */
  double least, most; /* both allowed; the least number above 0 where it must be above 0   */
} palpate_key;
/* The keys in order, key 0 first; NULL behind the last one. Constant. The first key of an effect switches it: at 0 it is off. */
PALPATE_API const palpate_key* palpate_scene_key(int32_t key);
/* The number in a field, of a CHOICE its index, the first one of an array; of a POINTER 1 where it is not NULL; 0 where
 * the definition has no part of that effect, and where the host's struct, which may be an earlier one, ends before the field. */
PALPATE_API double palpate_key_number(const palpate_key* key, const palpate_scene_def* def);
/* Sets it; palpate_scene_create compares it with the limits. Returns 1; 0 for a POINTER, and where there is no
 * such part or it ends before the field. */
PALPATE_API int32_t palpate_set_key(const palpate_key* key, palpate_scene_def* def, double number);

/* Puts the struct of each effect in front of the definition's chain, with its defaults and switched off. memory: of palpate_all_parts_bytes(), 8-byte
 * aligned; it belongs to the definition for as long as that is used. */
PALPATE_API size_t palpate_all_parts_bytes(void);
PALPATE_API void palpate_add_all_parts(palpate_scene_def* def, void* memory);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_KEYS_H */
