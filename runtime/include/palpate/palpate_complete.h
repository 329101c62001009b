/* palpate_complete.h - all headers of the library. */
#ifndef PALPATE_COMPLETE_H
#define PALPATE_COMPLETE_H

#include "palpate.h"
#include "palpate_device.h"
#include "palpate_fine_surface.h"
#include "palpate_force_control.h"
#include "palpate_grasps.h"
#include "palpate_inside.h"
#include "palpate_keys.h"
#include "palpate_large.h"
#include "palpate_links.h"
#include "palpate_loads.h"
#include "palpate_mailbox.h"
#include "palpate_motions.h"
#include "palpate_needles.h"
#include "palpate_passivity.h"
#include "palpate_plan.h"
#include "palpate_pose.h"
#include "palpate_queries.h"
#include "palpate_relaxation.h"
#include "palpate_report.h"
#include "palpate_skin.h"
#include "palpate_state.h"
#include "palpate_tool_shape.h"
#include "palpate_watchdog.h"
#include "palpate_world.h"
#include "palpate_world_links.h"
#include "palpate_world_pairs.h"
#include "palpate_world_plan.h"
#include "palpate_world_state.h"

#endif /* PALPATE_COMPLETE_H */
