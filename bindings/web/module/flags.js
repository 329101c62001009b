// The bits of a step's flags, as palpate.h defines them; 0 is a fully trusted step. What touch(), shape() and skin() return is a sum
// of these. tests/web/flags_test.mjs compares them with palpate.h.

/** NaN, infinity, a negative count, an unknown node: the tool kept its last good input. */
export const STEP_BAD_INPUT = 1 << 0;
/** More points than maxPoints, or more contacts than maxContactNodes has nodes for; the step kept the first ones. */
export const STEP_CONTACTS_DROPPED = 1 << 1;
/** Contacts conflict: some miss their displacement; their force has a stated bound. */
export const STEP_REGULARISED = 1 << 2;
/** A measured curve was used beyond its range, where it continues as a straight line. */
export const STEP_RESPONSE_RANGE = 1 << 3;
/** A force or a torque was cut to its limit or slew. */
export const STEP_FORCE_LIMITED = 1 << 4;
/** Of mapped files alone, which a browser has none. */
export const STEP_BUNDLE_LOST = 1 << 5;
/** A tool met nodes without a tensor column: the contact acts on the other nodes there, or is not made where there are none. */
export const STEP_NOT_TOUCHABLE = 1 << 6;
/** A number is not finite, or the stored precision is too coarse for so many contacts: the step has no contact forces, or no displacement
 *  of those nodes. */
export const STEP_UNSOLVED = 1 << 7;
/** The contacts given to shape() are of another bundle: the shape is at rest. */
export const STEP_OTHER_BUNDLE = 1 << 8;
/** A tool point moved too fast, jumped through the organ, or left its contact too far: it has no contact until it comes in again. */
export const STEP_TRACKING_LOST = 1 << 9;
/** The step reached maxOperations: the next steps do the rest. */
export const STEP_WORK_DEFERRED = 1 << 10;
/** The solver came to its limit: a contact or its law is missed. */
export const STEP_SOLVE_INEXACT = 1 << 11;
/** maxContactNodes is short: a disc acts on fewer nodes than it covers, and its force is too small. */
export const STEP_DISCS_THINNED = 1 << 12;
/** Large deformation: the body has not followed its tools to the end. */
export const STEP_DEFORMATION_BEHIND = 1 << 13;
/** A link came beyond its breaking force: it acted in this step for the last time. */
export const STEP_LINK_BROKE = 1 << 14;
/** The amounts of the motions changed faster than maxToolSpeed: they came so far only. */
export const STEP_MOTION_LIMITED = 1 << 15;
/** Two organs press one another with friction where a surface has turned by more than 60 degrees: tissue is carried along, beyond linear elasticity. */
export const STEP_FRICTION_JAMS = 1 << 16;
/** Of crossings() alone: the surface passes through itself. */
export const STEP_SURFACE_CROSSES = 1 << 17;
