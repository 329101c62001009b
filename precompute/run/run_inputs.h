// The input of a run: mesh, organ, boundary and measured curve, read and checked against one another before anything is
// computed.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "formats/organ_config.h"
#include "precompute/elements/elastic_body.h"
#include "precompute/run/precompute.h"
#include "precompute/run/response_fit.h"

namespace palpate {

struct RunInputs {
  OrganConfig organ;
  BoundaryConfig boundary;
  ElasticBody body;
  std::optional<ResponseFit> fit;
  bool store_interior = false;
  bool large_deformation = false;  // by the option or by [store] of the boundary file
  std::map<std::string, std::string>
      hashes;  // "mesh_sha256" and so on, for every file that was read; "" where there is none
};

// Errors: InputError.
RunInputs read_run_inputs(const PrecomputeOptions& options);

}  // namespace palpate
