/* palpate_mailbox.h - hands the newest contacts from the touch loop to the shape loop; neither loop ever waits.
 *
 * The mailbox has three slots of plain memory. The writer fills one, the reader keeps one, and the newest published contacts
 * lie in the third. Publishing and fetching are one atomic exchange each, so both are wait-free whatever the other loop does.
 * Contacts that were not fetched before the next ones are published are dropped. One thread writes and one thread reads. The
 * memory holds no pointers, so two processes may share it.
 *
 *   touch loop   palpate_contacts* c = palpate_mailbox_slot(box);
 *                palpate_scene_touch(scene, tools, count, dt, c);
 *                palpate_mailbox_publish(box);
 *   shape loop   const palpate_contacts* c = palpate_mailbox_newest(box, NULL);
 *                if (c) palpate_scene_shape(scene, c, &out);
 */
#ifndef PALPATE_MAILBOX_H
#define PALPATE_MAILBOX_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct palpate_mailbox palpate_mailbox;

/* Bytes of a mailbox for contacts of contacts_bytes = palpate_contacts_bytes(scene). */
PALPATE_API size_t palpate_mailbox_bytes(size_t contacts_bytes);

/* Makes an empty mailbox in the caller's memory: palpate_mailbox_bytes(contacts_bytes) bytes, 64-byte aligned, which must not
 * be copied or moved while in use. There is nothing to release. Returns NULL where memory is NULL or not aligned. */
PALPATE_API palpate_mailbox* palpate_mailbox_create(void* memory, size_t contacts_bytes);

/* The writer's slot. It may hold old contacts; palpate_scene_touch overwrites them. */
PALPATE_API palpate_contacts* palpate_mailbox_slot(palpate_mailbox* mailbox);

/* Publishes the writer's slot as the newest contacts. The writer's next slot is another one. */
PALPATE_API void palpate_mailbox_publish(palpate_mailbox* mailbox);

/* The newest contacts, which belong to the reader until its next call; NULL before the first ones were published. *fresh
 * becomes 1 where they were published since the last call, else 0; fresh may be NULL. */
PALPATE_API const palpate_contacts* palpate_mailbox_newest(palpate_mailbox* mailbox, int32_t* fresh);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_MAILBOX_H */
