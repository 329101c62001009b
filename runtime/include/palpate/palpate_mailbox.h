/* palpate_mailbox.h - hands the newest contacts from the touch loop to the shape loop, and neither ever waits.
 *
 * Three slots of plain memory: the writer fills one, the reader keeps one, and the newest that was published lies between
 * them. Publishing and fetching are one atomic exchange each, so both are wait-free, whatever the other side does; what was
 * not fetched before the next is published is dropped. One writing thread and one reading thread; the memory holds no
 * pointers and may be shared between processes.
 *
 *   touch loop   palpate_contacts* c = palpate_mailbox_slot(box);
 *                palpate_touch(scene, tools, count, dt, c);
 *                palpate_mailbox_publish(box);
 *   shape loop   const palpate_contacts* c = palpate_mailbox_newest(box, NULL);
 *                if (c) palpate_shape(scene, c, &out);
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

/* Makes an empty mailbox in memory of the caller's: palpate_mailbox_bytes(contacts_bytes) bytes, 64-byte aligned. Nothing is
 * to be released. NULL where memory is NULL or not aligned. Not to be copied or moved. */
PALPATE_API palpate_mailbox* palpate_mailbox_create(void* memory, size_t contacts_bytes);

/* The writer's slot. Its contents are whatever was written there some publishings ago; palpate_touch fills it anew. */
PALPATE_API palpate_contacts* palpate_mailbox_slot(palpate_mailbox* mailbox);

/* Makes the slot the newest; the writer's next slot is another one. */
PALPATE_API void palpate_mailbox_publish(palpate_mailbox* mailbox);

/* The newest contacts, the reader's own until its next call; NULL before the first were published. fresh, which may be NULL,
 * becomes 1 where they were published since the last call, else 0. */
PALPATE_API const palpate_contacts* palpate_mailbox_newest(palpate_mailbox* mailbox, int32_t* fresh);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_MAILBOX_H */
