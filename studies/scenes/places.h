// Where the study touches, grasps, links and pierces an organ: found on any organ from its surface.
#pragma once

#include <optional>
#include <vector>

#include "precompute/elements/elastic_body.h"
#include "studies/coupled/played_world.h"

namespace palpate::scenes {

using studies::free_scene, studies::open_bundle, studies::OrganAt, studies::PlayedWorld, studies::pose_at,
    studies::touching_scene, studies::turn_of;

// A place on the surface, in the organ's frame.
struct SurfacePlace {
  std::int32_t triangle = -1;
  Eigen::Vector3d point = Eigen::Vector3d::Zero(), outward = Eigen::Vector3d::Zero();
};
constexpr double kMiddle[3] = {1.0 / 3, 1.0 / 3, 1.0 / 3};  // all places are the middles of triangles

// The organ's box, and the side of it that is the freest to touch: there another organ stands in the study.
struct Box {
  Eigen::Vector3d low, high;
  int axis = 2;     // 0 .. 2: across that side
  double sign = 1;  // -1: the side at low[axis]
  double size() const { return (high - low).norm(); }
  double depth() const { return high[axis] - low[axis]; }
};
Box box_of(const ElasticBody& body);

// A straight way of a needle through the organ: from a place inwards, to where it would come out.
struct Way {
  SurfacePlace entry;
  Eigen::Vector3d inwards = Eigen::Vector3d::Zero();
  double length = 0;  // m
};

// The middles of triangles whose three corners may be touched along all axes, count of them at most, spread over the list.
std::vector<SurfacePlace> touchable_places(const ElasticBody& body, std::size_t count);
// The place among them whose way along the normal through the organ is the longest. Errors: InputError where there is none.
Way longest_way(const ElasticBody& body);
// The place that looks the most across the box's axis, so that organs in a stack along this axis leave it free.
SurfacePlace place_at_the_side(const ElasticBody& body, const Box& box);

// An organ that stands at the box's side, turned over so that both show one another the same side: `gap` m between both boxes.
palpate_pose over(const Box& box, double gap);

// m: the gap at which both touch first, found to within `within`.
double gap_of_first_touch(palpate_bundle* bundle, const Box& box, double within);

}  // namespace palpate::scenes
