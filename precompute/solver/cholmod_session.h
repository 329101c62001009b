// CHOLMOD's workspace and its objects, released in every way out. Included by this folder's sources only.
#pragma once

#include <suitesparse/cholmod.h>

namespace palpate {

// One cholmod_common. Errors of CHOLMOD are left in status; nothing is printed.
class CholmodSession {
 public:
  CholmodSession() {
    cholmod_l_start(&common);
    common.print = 0;
    common.error_handler = nullptr;
  }
  ~CholmodSession() {
    cholmod_l_free_sparse(&sparse, &common);
    cholmod_l_free_factor(&factor, &common);
    cholmod_l_finish(&common);
  }
  CholmodSession(const CholmodSession&) = delete;
  CholmodSession& operator=(const CholmodSession&) = delete;

  cholmod_common common;
  cholmod_sparse* sparse = nullptr;
  cholmod_factor* factor = nullptr;
};

}  // namespace palpate
