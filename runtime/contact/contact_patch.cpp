#include "runtime/contact/contact_patch.h"

#include <algorithm>

#include "runtime/base/exponential.h"

namespace palpate {
namespace {

// Gauss-Legendre nodes and weights on [0, 1] for s = sqrt(1 - r^2): under a rigid punch equal parts of s carry equal forces.
constexpr double kRing[ContactPatch::kRings] = {0.033765242898423986, 0.16939530676686775, 0.38069040695840155,
                                                0.61930959304159845,  0.83060469323313225, 0.96623475710157601};
constexpr double kRingShare[ContactPatch::kRings] = {0.085662246189585173, 0.18038078652406930, 0.23395696728634552,
                                                     0.23395696728634552,  0.18038078652406930, 0.085662246189585173};
// Cosine and sine of a spoke and of half a spoke; literals, so that every build has the same points.
constexpr double kCos = 0.95105651629515357, kSin = 0.30901699437494742;          // 18 degrees
constexpr double kHalfCos = 0.98768834059513777, kHalfSin = 0.15643446504023087;  // 9 degrees
static_assert(ContactPatch::kSpokes == 20);

// A triangle whose normal differs from the disc's by more than 78 degrees (cosine) belongs to another side of the organ.
constexpr double kFacing = 0.2;
// Tolerance on barycentric weights: rounding may place a point on an edge outside both of its triangles.
constexpr double kOnEdge = 1e-9;

// Where the disc reaches beyond this many buckets, the search visits all triangles instead.
constexpr double kMostReach = 12;

int bin_of(double x, int bins) {
  return std::clamp(static_cast<int>((x + 1) * 0.5 * bins), 0, bins - 1);
}

// The symmetric root of (uu, uv; uv, vv) / over, a positive definite matrix; of that of a plane where `over` is not above zero.
struct PlaneRoot {
  double uu = 1, vv = 1, uv = 0;
};
PlaneRoot root_of(double uu, double vv, double uv, double over) {
  if (!(over > 0)) return {};
  uu /= over, vv /= over, uv /= over;
  const double determinant = std::sqrt(std::max(0.0, uu * vv - uv * uv)), sum = uu + vv + 2 * determinant;
  if (!(sum > 0)) return {};
  const double size = 1 / std::sqrt(sum);
  return {size * (uu + determinant), size * (vv + determinant), size * uv};
}

}  // namespace

Vec3 across(Vec3 n, Vec3 like) {
  Vec3 t = unit_or_zero(like - dot(like, n) * n);
  if (length(t) > 0) return t;
  const Vec3 axis = std::fabs(n.x) <= std::fabs(n.y) && std::fabs(n.x) <= std::fabs(n.z) ? Vec3{1, 0, 0}
                    : std::fabs(n.y) <= std::fabs(n.z)                                   ? Vec3{0, 1, 0}
                                                                                         : Vec3{0, 0, 1};
  return unit_or_zero(axis - dot(axis, n) * n);
}

bool ContactPatch::create(SceneMemory& memory, SurfaceIndex* surface, const SurfaceMeasure* measure,
                          const std::int32_t* triangles, std::int32_t nodes, const NodeFans* fans) {
  surface_ = surface, measure_ = measure, triangles_ = triangles, fans_ = fans;
  if (fans) {
    connected_ = memory.array<std::int32_t>(static_cast<std::size_t>(surface->triangle_count()));
    seen_ = memory.array<std::uint32_t>(static_cast<std::size_t>(surface->triangle_count()));
  }
  index_of_node_ = memory.array<std::int32_t>(static_cast<std::size_t>(nodes));
  if (memory.failed()) return false;
  std::fill(index_of_node_, index_of_node_ + nodes, -1);

  double x[kPoints], y[kPoints], share[kPoints];
  int bin[kPoints];
  for (int ring = 0; ring < kRings; ++ring) {
    const double r = std::sqrt(1 - kRing[ring] * kRing[ring]);
    double c = ring % 2 ? kHalfCos : 1, s = ring % 2 ? kHalfSin : 0;
    for (int spoke = 0; spoke < kSpokes; ++spoke) {
      const int p = ring * kSpokes + spoke;
      x[p] = r * c, y[p] = r * s, share[p] = kRingShare[ring] / kSpokes;
      bin[p] = bin_of(y[p], kBins) * kBins + bin_of(x[p], kBins);
      ++bin_begin_[bin[p] + 1];
      const double turned = c * kCos - s * kSin;
      s = s * kCos + c * kSin, c = turned;
    }
  }
  for (int b = 0; b < kBins * kBins; ++b) bin_begin_[b + 1] += bin_begin_[b];
  int next[kBins * kBins];
  std::copy(bin_begin_, bin_begin_ + kBins * kBins, next);
  for (int p = 0; p < kPoints; ++p) {
    const int to = next[bin[p]]++;
    x_[to] = x[p], y_[to] = y[p], share_[to] = share[p];
  }
  return true;
}

// Finds the quadrature points that lie over a triangle, seen along the normal. Where several triangles lie over one point, the
// triangle nearest to the disc's plane gets it. False where the triangle faces another way or lies beside the disc.
bool ContactPatch::find_points(std::int32_t triangle, Vec3 centre, Vec3 outward, Vec3 u, Vec3 v, double b) {
  if (dot(surface_->outward(triangle), outward) < kFacing) return false;
  double x[3], y[3], z[3];
  for (int k = 0; k < 3; ++k) {
    const Vec3 p = (1 / b) * (surface_->corner(triangle, k) - centre);
    x[k] = dot(p, u), y[k] = dot(p, v), z[k] = dot(p, outward);
  }
  const double left = std::min({x[0], x[1], x[2]}), right = std::max({x[0], x[1], x[2]}),
               low = std::min({y[0], y[1], y[2]}), high = std::max({y[0], y[1], y[2]});
  if (left > 1 || right < -1 || low > 1 || high < -1) return false;
  const double twice_area = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]);
  if (!(twice_area > 0)) return false;
  for (int row = bin_of(low, kBins); row <= bin_of(high, kBins); ++row)
    for (int p = bin_begin_[row * kBins + bin_of(left, kBins)]; p < bin_begin_[row * kBins + bin_of(right, kBins) + 1];
         ++p) {
      double k[3];
      for (int c = 0; c < 3; ++c) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        k[c] = ((x[d] - x_[p]) * (y[e] - y_[p]) - (y[d] - y_[p]) * (x[e] - x_[p])) / twice_area;
      }
      if (k[0] < -kOnEdge || k[1] < -kOnEdge || k[2] < -kOnEdge) continue;
      const auto height = static_cast<float>(std::fabs(k[0] * z[0] + k[1] * z[1] + k[2] * z[2]));
      if (height > 2 || (hit_[p].triangle >= 0 && hit_[p].height <= height)) continue;
      hit_[p] = {triangle, height, {k[0], k[1], k[2]}};
    }
  return true;
}

// Calls find(triangle) for `first` and for what hangs together with it, across the edges of triangles for which find() was true.
template <class Find>
void ContactPatch::find_connected(std::int32_t first, Find find) {
  if (++call_ == 0) std::fill(seen_, seen_ + surface_->triangle_count(), 0u), call_ = 1;
  std::int32_t count = 0;
  const auto add = [&](std::int32_t triangle) {
    if (seen_[triangle] != call_) seen_[triangle] = call_, connected_[count++] = triangle;
  };
  add(first);
  for (std::int32_t i = 0; i < count; ++i) {
    if (!find(connected_[i]) && i > 0) continue;
    const std::int32_t* const node = triangles_ + 3 * connected_[i];
    // The triangle beyond an edge has it the other way round.
    for (int v = 0; v < 3; ++v)
      fans_->around(node[v], [&](std::int32_t triangle, int corner) {
        if (triangles_[3 * triangle + (corner + 2) % 3] == node[(v + 1) % 3]) add(triangle);
      });
  }
}

void ContactPatch::press(const SurfacePoint& surface_point, Vec3 outward, Vec3 tangent, double a, double resolved) {
  a = std::max(a, kLeastRadius);
  const double b = std::max(a, resolved * measure_->spacing(surface_point));
  for (Hit& hit : hit_) hit.triangle = -1;
  const Vec3 centre = surface_->position(surface_point), other = cross(outward, tangent);
  const auto find = [&](std::int32_t triangle) { return find_points(triangle, centre, outward, tangent, other, b); };
  if (fans_)
    find_connected(surface_point.triangle, find);
  else if (const double reach = 1 + b / surface_->bucket_size(); reach < kMostReach)
    surface_->near(centre, static_cast<int>(reach), find);
  else
    for (std::int32_t triangle = 0; triangle < surface_->triangle_count(); ++triangle) find(triangle);
  gather_nodes(surface_point);
  radius_ = b;
  measure_local(surface_point, outward, tangent, other, a, b);
}

void ContactPatch::gather_nodes(const SurfacePoint& surface_point) {
  count_ = 0;
  const auto add = [&](std::int32_t triangle, const double* k, double share) {
    for (int c = 0; c < 3; ++c) {
      if (!(k[c] > 0)) continue;
      const std::int32_t node = triangles_[3 * triangle + c];
      std::int32_t& entry = index_of_node_[node];
      if (entry < 0) {
        entry = count_++;
        node_[entry] = node, weight_[entry] = 0;
      }
      weight_[entry] += k[c] * share;
    }
  };
  for (int p = 0; p < kPoints; ++p)
    if (hit_[p].triangle >= 0) add(hit_[p].triangle, hit_[p].barycentric, share_[p]);
  if (count_ == 0) add(surface_point.triangle, surface_point.barycentric, 1);
  for (int e = 0; e < count_; ++e) index_of_node_[node_[e]] = -1;
}

void ContactPatch::first_moments(double* along, double* across) {
  for (int e = 0; e < count_; ++e) index_of_node_[node_[e]] = e, along[e] = across[e] = 0;
  for (int p = 0; p < kPoints; ++p) {
    if (hit_[p].triangle < 0) continue;
    for (int c = 0; c < 3; ++c) {
      const double* k = hit_[p].barycentric;
      if (!(k[c] > 0)) continue;
      const std::int32_t e = index_of_node_[triangles_[3 * hit_[p].triangle + c]];
      along[e] += k[c] * share_[p] * radius_ * x_[p], across[e] += k[c] * share_[p] * radius_ * y_[p];
    }
  }
  for (int e = 0; e < count_; ++e) index_of_node_[node_[e]] = -1;
}

namespace {

// Of a disc's radius times the trace of the curvature below it.
constexpr double kMostBend = 3;

// 1/m, along u and v: the gradients of a triangle's three hat functions, seen along the normal.
struct HatSlopes {
  HatSlopes(const SurfaceIndex& surface, std::int32_t triangle, Vec3 u, Vec3 v) {
    double x[3], y[3];
    for (int c = 0; c < 3; ++c) x[c] = dot(surface.corner(triangle, c), u), y[c] = dot(surface.corner(triangle, c), v);
    const double twice_area = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]);
    for (int c = 0; c < 3 && twice_area > 0; ++c) {
      const int d = (c + 1) % 3, e = (c + 2) % 3;
      along[c] = (y[d] - y[e]) / twice_area, across[c] = (x[e] - x[d]) / twice_area;
    }
  }
  double along[3] = {}, across[3] = {};
};

}  // namespace

Vec3 ContactPatch::spacing_slope(std::int32_t triangle, Vec3 u, Vec3 v) const {
  const HatSlopes hat(*surface_, triangle, u, v);
  Vec3 sum;
  for (int c = 0; c < 3; ++c)
    sum += measure_->spacing(triangles_[3 * triangle + c]) * (hat.along[c] * u + hat.across[c] * v);
  return sum;
}

// The mean place is that of the nodes, lifted along their normals by what a disc on a curved surface lies below it, tr(K) b^2 / 6: so it lies at
// the surface, and is smooth where the triangles have edges.
void ContactPatch::measure_slopes(const SurfacePoint& surface_point, Vec3 outward, Vec3 tangent, double a, Vec3* slope,
                                  DiscPlace* place) {
  a = std::max(a, kLeastRadius);
  const Vec3 other = cross(outward, tangent);
  const double s = measure_->spacing(surface_point);
  const bool grows = radius_ > a;
  const Vec3 wider = spacing_slope(surface_point.triangle, tangent, other);
  for (int e = 0; e < count_; ++e) index_of_node_[node_[e]] = e, slope[e] = Vec3{};
  Vec3 lost;
  for (int p = 0; p < kPoints; ++p) {
    if (hit_[p].triangle < 0) continue;
    const HatSlopes hat(*surface_, hit_[p].triangle, tangent, other);
    for (int c = 0; c < 3; ++c) {
      const std::int32_t e = index_of_node_[triangles_[3 * hit_[p].triangle + c]];
      if (e < 0) continue;
      Vec3 change = hat.along[c] * tangent + hat.across[c] * other;
      if (grows) change += kResolved * (hat.along[c] * x_[p] + hat.across[c] * y_[p]) * wider;
      slope[e] += share_[p] * change, lost += share_[p] * change;
    }
  }
  for (int e = 0; e < count_; ++e) index_of_node_[node_[e]] = -1;
  double whole = 0;
  for (int e = 0; e < count_; ++e) whole += weight_[e];
  Vec3 at, rise;
  double lifted = 0;
  for (int e = 0; e < count_; ++e) {
    slope[e] += (-weight_[e] / whole) * lost;
    const Mat3& k = measure_->curvature(node_[e]);
    const double bend = std::clamp((k.m[0][0] + k.m[1][1] + k.m[2][2]) * radius_, -kMostBend, kMostBend);
    const Vec3 up = measure_->outward(node_[e]), x = surface_->node(node_[e]) + bend * radius_ / 6 * up;
    at += weight_[e] * x, rise += dot(x, outward) * slope[e];
    lifted += weight_[e] * bend / 3 * dot(up, outward);
  }
  place->at = (1 / whole) * at;
  place->rise = (1 / whole) * (grows ? rise + kResolved * lifted * wider : rise);
  const LocalCompliance tissue = measure_->tissue(surface_point);
  const double wide = radius_ + tissue.normal_blur * s;
  place->softer = tissue.normal / (wide * wide) * (tissue.normal_blur + (grows ? kResolved : 0)) * wider;
}

void ContactPatch::measure_local(const SurfacePoint& surface_point, Vec3 outward, Vec3 u, Vec3 v, double a, double b) {
  const LocalCompliance tissue = measure_->tissue(surface_point);
  const double s = measure_->spacing(surface_point), wide = b + tissue.tangent_blur * s;
  const double normal = tissue.normal * (1 / a - 1 / (b + tissue.normal_blur * s)),
               tangent = tissue.tangent * (1 / a - 1 / wide), between = natural_log(wide / a);

  Mat3 sum;
  double whole = 0;
  for (int e = 0; e < count_; ++e) add_scaled(sum, weight_[e], measure_->curvature(node_[e])), whole += weight_[e];
  const Vec3 along_u = sum * u, along_v = sum * v;
  double uu = dot(u, along_u) / whole, vv = dot(v, along_v) / whole, uv = dot(u, along_v) / whole;
  // The curvature term is of first order in curvature times radius, so it holds up to a curvature of 1 / radius. Larger
  // curvatures are cut to that, which also keeps the compliance positive in a hollow.
  const double most = 0.5 * (std::fabs(uu + vv) + std::sqrt((uu - vv) * (uu - vv) + 4 * uv * uv));
  const double share = most * wide > 1 ? 1 / (most * wide) : 1;
  uu *= share, vv *= share, uv *= share;
  const double level = tangent + between * tissue.curved_trace * (uu + vv);
  uu = level + between * tissue.curved * uu, vv = level + between * tissue.curved * vv, uv *= between * tissue.curved;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      local_.m[i][j] =
          normal * outward[i] * outward[j] + uu * u[i] * u[j] + vv * v[i] * v[j] + uv * (u[i] * v[j] + v[i] * u[j]);

  const PlaneRoot root = root_of(uu, vv, uv, tangent);
  const double size = std::sqrt(tissue.tangent * shared_part(a, wide));
  disc_.radius = a, disc_.wide[0] = b + tissue.normal_blur * s, disc_.wide[1] = wide;
  disc_.place = surface_->position(surface_point), disc_.outward = outward;
  disc_.normal_root = std::sqrt(tissue.normal * shared_part(a, disc_.wide[0])) * outward;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      disc_.tangent_root.m[i][j] =
          size * (root.uu * u[i] * u[j] + root.vv * v[i] * v[j] + root.uv * (u[i] * v[j] + v[i] * u[j]));
}

}  // namespace palpate
