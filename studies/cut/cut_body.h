// A body that is cut, for the study and the tests: its mesh after each change, its stiffness assembled and factored anew, and its compliance as a
// bundle would store it.
#pragma once

#include <Eigen/Dense>
#include <memory>
#include <utility>
#include <vector>

#include "precompute/elements/discretisation.h"
#include "runtime/cut/cut_change.h"
#include "runtime/cut/pair_compliance.h"

namespace palpate {

// A CutChange that owns its arrays.
struct OwnedChange {
  std::vector<CutChange::NewNode> new_nodes;
  std::vector<CutChange::Moved> moved;
  std::vector<std::int32_t> removed;
  CutChange get() const;
};

class CutReference {
 public:
  explicit CutReference(ElasticBody rest);
  const ElasticBody& rest() const { return rest_; }
  // Nodes with the new ones, tetrahedra with their corners now; removed ones are still there.
  const std::vector<std::array<std::int32_t, 4>>& corners() const { return body_.tetrahedra; }
  bool is_left(std::size_t e) const { return left_[e]; }
  std::int32_t nodes() const { return static_cast<std::int32_t>(body_.nodes.size()); }
  const std::array<double, 3>& position(std::int32_t node) const { return body_.nodes[static_cast<std::size_t>(node)]; }

  void apply(const OwnedChange& change);
  // Loads on the nodes at rest, [3 nodes] N: where a node splits, each part takes the share of the volume of the tetrahedra that are at it.
  Eigen::VectorXd divided(const Eigen::VectorXd& load) const;
  // The tetrahedra at a node for which goes(tetrahedron) is true get a copy of it. Empty where none or all go.
  template <class Goes>
  OwnedChange split(std::int32_t node, Goes goes) const {
    OwnedChange change;
    std::size_t at = 0;
    for (std::size_t e = 0; e < body_.tetrahedra.size(); ++e) {
      const auto& t = body_.tetrahedra[e];
      if (!left_[e] || std::find(t.begin(), t.end(), node) == t.end()) continue;
      ++at;
      if (!goes(e)) continue;
      CutChange::Moved moved{static_cast<std::int32_t>(e), {t[0], t[1], t[2], t[3]}};
      std::replace(moved.corners, moved.corners + 4, node, nodes());
      change.moved.push_back(moved);
    }
    if (change.moved.empty() || change.moved.size() == at) return {};
    change.new_nodes.push_back({nodes(), node});
    return change;
  }
  std::array<double, 3> centre(std::size_t e) const;
  // What is left, as a body of its own with the same nodes. Foundations are below the triangles that are left, with the corners that they have now; of a
  // spring each node at its place has the share that the node has of the area of the triangles there whose corners all have springs.
  ElasticBody now() const;

 private:
  std::vector<std::vector<std::pair<std::int32_t, double>>> shares_of_springs() const;
  double volume_at(std::int32_t node) const;

  ElasticBody body_, rest_;
  std::vector<char> left_;
  std::vector<std::int32_t> origin_;  // [nodes] node at rest
  std::vector<double> share_;         // [nodes] of the loads there
  std::vector<std::size_t> below_;    // [triangles] tetrahedron
};

// K of a body, factored. A node without tetrahedra stands on a spring.
class FactoredBody {
 public:
  FactoredBody(const ElasticBody& body, Element element);
  ~FactoredBody();
  // Displacements of all nodes under unit forces on the dofs of these nodes, [3 nodes][3 listed]; m/N.
  Eigen::MatrixXd columns(const std::vector<std::int32_t>& nodes) const;
  Eigen::VectorXd solve(const Eigen::VectorXd& force) const;
  bool is_definite() const;

 private:
  struct Factor;
  std::unique_ptr<Factor> factor_;
  std::vector<int> row_;  // of each dof; -1: held
};

// The stored compliance of some nodes: in double precision, or each number rounded to single.
class StoredPairs final : public PairCompliance {
 public:
  StoredPairs(const FactoredBody& body, const std::vector<std::int32_t>& nodes, std::int32_t all_nodes,
              bool single = false);
  // matrix: [3 listed][3 listed].
  StoredPairs(Eigen::MatrixXd matrix, const std::vector<std::int32_t>& nodes, std::int32_t all_nodes, bool single);
  bool read(std::int32_t node, const std::int32_t* others, std::int32_t count, double* rows,
            std::size_t stride) const override;

 private:
  Eigen::MatrixXd matrix_;
  std::vector<std::int32_t> index_;  // of each node; -1: none
};

}  // namespace palpate
