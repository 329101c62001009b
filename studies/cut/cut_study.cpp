// cut_study MESH --organ organ.toml --boundary bc.toml -o FOLDER: what a cut costs and how exact it is; make -f Makefile.data cut-study.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>

#include "formats/command_line.h"
#include "formats/organ_config.h"
#include "formats/program.h"
#include "formats/tetrahedral_mesh.h"
#include "runtime/cut/cut_compliance.h"
#include "studies/accuracy/command.h"
#include "studies/accuracy/results.h"
#include "studies/cut/cut_body.h"
#include "studies/hyperelastic/large_body.h"
#include "studies/timing/timing.h"

namespace palpate::cut {
namespace {

using Json = nlohmann::ordered_json;
using Nodes = std::vector<std::int32_t>;

struct Options {
  std::filesystem::path mesh, organ, boundary, output, image, source, python;
  int most = 300;
  bool quick = false;
};

constexpr std::int32_t kRebaseRank = 300;

double along(const std::array<double, 3>& p, int axis) {
  return p[static_cast<std::size_t>(axis)];
}

struct Setting {
  Element element;
  std::string cut;       // "split" or "removed"
  bool single, rebased;  // stored in single precision; re-based at a rank of 300
};

// The changes of one cut, each of a node or of a tetrahedron, and what a bundle stores for it.
struct Plan {
  std::vector<std::int32_t> order;  // nodes on the plane, or tetrahedra
  Nodes region, contacts;
  int axis = 0;  // across the plane
  double plane = 0;
};

// A plane through the middle of the body, across its shortest extent, cut from the side that is farthest from what is held.
Plan plan_of(const ElasticBody& body, const std::string& kind) {
  Plan plan;
  std::array<double, 3> low = body.nodes[0], high = low, held{};
  int held_count = 0;
  for (std::size_t n = 0; n < body.nodes.size(); ++n)
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], body.nodes[n][i]), high[i] = std::max(high[i], body.nodes[n][i]);
      if (body.fixed[n][0]) held[i] += body.nodes[n][i], held_count += i == 0;
    }
  for (int i = 1; i < 3; ++i)
    if (along(high, i) - along(low, i) < along(high, plan.axis) - along(low, plan.axis)) plan.axis = i;
  plan.plane = 0.5 * (along(low, plan.axis) + along(high, plan.axis));
  std::array<double, 3> middle{};
  for (std::size_t i = 0; i < 3; ++i) {
    middle[i] = held_count > 0 ? held[i] / held_count : low[i];
    if (static_cast<int>(i) == plan.axis) middle[i] = plan.plane;
  }
  const auto distance = [&](const std::array<double, 3>& p) {
    return std::hypot(p[0] - middle[0], p[1] - middle[1], p[2] - middle[2]);
  };
  const CutReference uncut(body);
  std::vector<std::pair<double, std::int32_t>> found;
  if (kind == "split") {
    std::vector<int> sides(body.nodes.size(), 0);
    for (std::size_t e = 0; e < body.tetrahedra.size(); ++e)
      for (const auto n : body.tetrahedra[e])
        sides[static_cast<std::size_t>(n)] |= along(uncut.centre(e), plan.axis) > plan.plane ? 1 : 2;
    for (std::size_t n = 0; n < body.nodes.size(); ++n)
      if (sides[n] == 3) found.emplace_back(-distance(body.nodes[n]), static_cast<std::int32_t>(n));
  } else {
    const auto far = std::ranges::max_element(body.nodes, {}, distance);
    for (std::size_t e = 0; e < body.tetrahedra.size(); ++e) {
      const auto c = uncut.centre(e);
      found.emplace_back(std::hypot(c[0] - (*far)[0], c[1] - (*far)[1], c[2] - (*far)[2]),
                         static_cast<std::int32_t>(e));
    }
  }
  std::sort(found.begin(), found.end());
  for (const auto& f : found) plan.order.push_back(f.second);
  for (std::size_t k = 0; k < 20; ++k) plan.contacts.push_back(body.touchable[k * body.touchable.size() / 20]);
  return plan;
}

// The nodes whose columns the first changes need: those of the tetrahedra, and with averaging sites one ring more.
Nodes region_of(const ElasticBody& body, const Plan& plan, const Setting& setting, std::size_t changes) {
  std::vector<char> in(body.nodes.size(), 0);
  for (std::size_t k = 0; k < std::min(changes, plan.order.size()); ++k) {
    if (setting.cut == "split")
      in[static_cast<std::size_t>(plan.order[k])] = 1;
    else
      for (const auto n : body.tetrahedra[static_cast<std::size_t>(plan.order[k])]) in[static_cast<std::size_t>(n)] = 1;
  }
  const int rings = (setting.cut == "split") + (setting.element != Element::p1);
  for (int ring = 0; ring < rings; ++ring) {
    const std::vector<char> before = in;
    for (const auto& t : body.tetrahedra)
      if (std::ranges::any_of(t, [&](std::int32_t n) { return before[static_cast<std::size_t>(n)]; }))
        for (const auto n : t) in[static_cast<std::size_t>(n)] = 1;
  }
  Nodes nodes;
  for (std::size_t n = 0; n < in.size(); ++n)
    if (in[n]) nodes.push_back(static_cast<std::int32_t>(n));
  return nodes;
}

class Study {
 public:
  Study(const ElasticBody& body, const Setting& setting, int most)
      : setting_(setting), plan_(plan_of(body, setting.cut)), most_(static_cast<std::size_t>(most)), body_(body) {
    // Six tenths of the places on the plane at most: the body stays whole.
    if (setting.cut == "split") most_ = std::min(most_, plan_.order.size() * 6 / 10);
    // A few of the first are not made: nothing goes with the node, or a piece would come loose.
    plan_.order.resize(std::min(plan_.order.size(), most_ + most_ / 5 + 5));
    region_ = region_of(body, plan_, setting, plan_.order.size());
    std::set<std::int32_t> columns(region_.begin(), region_.end());
    columns.insert(plan_.contacts.begin(), plan_.contacts.end());
    const FactoredBody factored(body, setting.element);
    listed_.assign(columns.begin(), columns.end());
    large_ = std::make_unique<LargeBody>(body, setting_.element);
    pairs_ = std::make_unique<StoredPairs>(factored, listed_, body_.nodes(), setting.single);
    CutCapacity capacity{static_cast<std::int32_t>(listed_.size()), static_cast<std::int32_t>(most_) + 1, 0,
                         setting_.single ? 2e-3 : 1e-9};
    capacity.patterns = setting_.cut == "split" ? 7 * static_cast<std::int32_t>(most_) + 60
                                                : 4 * static_cast<std::int32_t>(listed_.size()) + 60;
    if (setting_.rebased) capacity.nodes += capacity.new_nodes, capacity.patterns = std::min(capacity.patterns, 500);
    if (!cut_->create(memory_, large_->get(), *pairs_, capacity) ||
        (setting_.rebased && !next_->create(memory_, large_->get(), *pairs_, capacity)))
      throw std::bad_alloc();
  }
  ~Study() { memory_.release_all(); }

  std::vector<Json> run() {
    std::vector<Json> points;
    for (std::size_t k = 0; done_ < most_ && k < plan_.order.size(); ++k) {
      if (!change(plan_.order[k])) continue;
      ++done_;
      for (const std::size_t at : {1, 10, 30, 100, 200, 300})
        if (done_ == at) points.push_back(point());
      if (setting_.rebased && cut_->rank() >= kRebaseRank) rebase();
    }
    if (points.empty() || points.back()["count"] != done_) points.push_back(point());
    return points;
  }

 private:
  bool change(std::int32_t item) {
    OwnedChange change;
    if (setting_.cut == "removed")
      change.removed = {item};
    else
      change = body_.split(item, [&](std::size_t e) { return along(body_.centre(e), plan_.axis) > plan_.plane; });
    if (change.removed.empty() && change.new_nodes.empty()) return false;
    const double begun = studies::thread_seconds();
    const CutResult result = cut_->apply(change.get());
    took_.push_back(studies::thread_seconds() - begun);
    least_share_ = std::min(least_share_, result.outcome == CutOutcome::made ? result.least_share : 1);
    if (result.outcome != CutOutcome::made) {
      if (result.outcome != CutOutcome::loose)
        throw std::runtime_error(fmt::format("a change was not made: {}", static_cast<int>(result.outcome)));
      took_.pop_back(), ++refused_;
      return false;
    }
    body_.apply(change);
    return true;
  }

  // The nodes at which errors are measured: contacts, and every fifth new node.
  Nodes asked() const {
    Nodes nodes;
    for (std::int32_t n = body_.nodes() - 1; n >= static_cast<std::int32_t>(body_.rest().nodes.size()); n -= 5)
      nodes.push_back(n);
    if (nodes.size() > 20) nodes.resize(20);
    for (const auto n : plan_.contacts)
      for (std::size_t e = 0; e < body_.corners().size(); ++e)
        if (body_.is_left(e) && std::ranges::find(body_.corners()[e], n) != body_.corners()[e].end()) {
          nodes.push_back(n);
          break;
        }
    return nodes;
  }

  // C' between nodes, [3 nodes][3 nodes]; the times of a node and of a pair.
  Eigen::MatrixXd compliance(const Nodes& nodes, std::vector<double>* contact, double* pair) {
    const auto count = static_cast<Eigen::Index>(nodes.size());
    std::vector<std::vector<double>> response(nodes.size(), std::vector<double>(cut_->response_numbers()));
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const double begun = studies::thread_seconds();
      if (!cut_->find_response(nodes[k], response[k].data())) throw std::runtime_error("a node has no column");
      contact->push_back(studies::thread_seconds() - begun);
    }
    Eigen::MatrixXd is(3 * count, 3 * count);
    const double begun = studies::thread_seconds();
    for (Eigen::Index a = 0; a < count; ++a)
      for (Eigen::Index b = 0; b < count; ++b) {
        const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
        Mat3 block;
        cut_->between(nodes[i], response[i].data(), nodes[j], response[j].data(), &block);
        for (int r = 0; r < 3; ++r)
          for (int s = 0; s < 3; ++s) is(3 * a + r, 3 * b + s) = block.m[r][s];
      }
    *pair = (studies::thread_seconds() - begun) / static_cast<double>(count * count);
    return is;
  }

  Json point() {
    const Nodes nodes = asked();
    const auto count = static_cast<Eigen::Index>(nodes.size());
    std::vector<double> contact;
    double pair = 0;
    compliance(nodes, &contact, &pair);
    const Eigen::MatrixXd is = compliance(nodes, &contact, &pair);
    const Eigen::MatrixXd columns = FactoredBody(body_.now(), setting_.element).columns(nodes);
    Eigen::MatrixXd right(3 * count, 3 * count);
    for (std::size_t k = 0; k < nodes.size(); ++k)
      right.middleRows(3 * static_cast<Eigen::Index>(k), 3) = columns.middleRows(3 * nodes[k], 3);
    double force_error = 0;
    for (Eigen::Index k = 0; k < count; ++k) {
      const Eigen::Matrix3d held = is.block<3, 3>(3 * k, 3 * k), right_held = right.block<3, 3>(3 * k, 3 * k);
      const Eigen::Vector3d way(0.3, 0.5, -1), force = right_held.fullPivLu().solve(way);
      if (right_held.fullPivLu().isInvertible())
        force_error = std::max(force_error, (held.fullPivLu().solve(way) - force).norm() / force.norm());
    }
    const double region = static_cast<double>(region_.size());
    const std::vector<double> last(took_.end() - std::min<std::ptrdiff_t>(20, std::ssize(took_)), took_.end());
    return {{"element", std::string(name_of(setting_.element))},
            {"cut", setting_.cut},
            {"stored", setting_.single ? "f32" : "f64"},
            {"rebases_at", setting_.rebased ? kRebaseRank : 0},
            {"rebased", rebases_},
            {"count", done_},
            {"rank", cut_->rank()},
            {"slots", cut_->slots()},
            {"change_us", 1e6 * studies::percentile(last, 0.5)},
            {"worst_us", 1e6 * *std::ranges::max_element(last)},
            {"contact_us", 1e6 * studies::percentile(contact, 0.5)},
            {"between_us", 1e6 * pair},
            {"compliance_error", (is - right).norm() / right.norm()},
            {"force_error", force_error},
            {"least_share", least_share_},
            {"loose", refused_},
            {"region_nodes", region_.size()},
            {"region_MB", 1e-6 * (setting_.single ? 4 : 8) * 9 * region *
                              (region + static_cast<double>(body_.rest().surface_count))}};
  }

  void rebase() {
    Nodes nodes = listed_;
    for (std::int32_t n = large_->get().node_count; n < body_.nodes(); ++n) nodes.push_back(n);
    std::vector<double> contact;
    double pair = 0;
    auto pairs =
        std::make_unique<StoredPairs>(compliance(nodes, &contact, &pair), nodes, body_.nodes(), setting_.single);
    next_->begin_from(*cut_, *pairs);
    std::swap(cut_, next_), std::swap(pairs_, pairs);
    ++rebases_;
  }

  Setting setting_;
  Plan plan_;
  std::size_t most_, done_ = 0;
  CutReference body_;
  Nodes region_, listed_;
  SceneMemory memory_{palpate_allocator{}};
  std::unique_ptr<LargeBody> large_;
  std::unique_ptr<StoredPairs> pairs_;
  std::unique_ptr<CutCompliance> cut_ = std::make_unique<CutCompliance>(), next_ = std::make_unique<CutCompliance>();
  std::vector<double> took_;
  double least_share_ = 1;
  int rebases_ = 0, refused_ = 0;
};

void define(CLI::App& app, Options& options) {
  app.add_option("mesh", options.mesh, "the organ's tetrahedra")->option_text("MESH.msh REQUIRED")->required();
  app.add_option("--organ", options.organ, "its organ.toml")->option_text("FILE REQUIRED")->required();
  app.add_option("--boundary", options.boundary, "its boundary set")->option_text("FILE REQUIRED")->required();
  app.add_option("-o,--output", options.output, "the study's folder")->option_text("FOLDER REQUIRED")->required();
  app.add_option("--image", options.image, "the image of the mesh, where the boundary set reads it")
      ->option_text("FILE");
  app.add_option("--python", options.python, "a Python with matplotlib, for the report")->capture_default_str();
  app.add_option("--most", options.most, "split nodes and removed tetrahedra")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_flag("--quick", options.quick, "p1 alone, and ten changes");
}

void run(const Options& options) {
  const auto begun = studies::Clock::now();
  const ElasticBody body = make_elastic_body(read_mesh(options.mesh), read_organ_config(options.organ),
                                             read_boundary_config(options.boundary),
                                             {options.mesh, options.organ, options.boundary, options.image});
  std::vector<Json> points;
  for (const Element element : {Element::p1, Element::p1_anp})
    for (const char* cut : {"split", "removed"})
      for (const bool rebased : {false, true})
        for (const bool single : {false, true}) {
          if (options.quick && (element != Element::p1 || rebased)) continue;
          for (Json& point : Study(body, {element, cut, single, rebased}, options.quick ? 10 : options.most).run()) {
            note(fmt::format("{} {} {}{}: {} changes, rank {}, error {:.1e}, {:.0f} us a change, {:.0f} us a contact",
                             point["element"].get<std::string>(), cut, point["stored"].get<std::string>(),
                             rebased ? " re-based" : "", point["count"].get<int>(), point["rank"].get<int>(),
                             point["compliance_error"].get<double>(), point["change_us"].get<double>(),
                             point["contact_us"].get<double>()));
            points.push_back(accuracy::with_nulls(std::move(point)));
          }
        }
  const Json all = {{"program", "cut_study"},
                    {"program_version", PALPATE_VERSION},
                    {"mesh", options.mesh.string()},
                    {"boundary", options.boundary.string()},
                    {"vertices", body.surface_count},
                    {"nodes", body.nodes.size()},
                    {"tetrahedra", body.tetrahedra.size()},
                    {"machine", accuracy::machine_json()},
                    {"took_s", studies::seconds_since(begun)}};
  std::filesystem::create_directories(options.output / "logs");
  accuracy::write_results(options.output, "cut", all, points);
  note(accuracy::write_report(options.python, options.source, "cut", options.output, "cut").string() + ": the report");
}

}  // namespace
}  // namespace palpate::cut

int main(int argc, char** argv) {
  palpate::cut::Options options;
  options.source = PALPATE_SOURCE_FOLDER, options.python = "/usr/bin/python3";
  return palpate::run_program(
      argc, argv, "cut_study", "Measures what a cut of an organ costs, against the cut mesh solved anew.",
      [&](CLI::App& app) { palpate::cut::define(app, options); }, [&] { palpate::cut::run(options); });
}
