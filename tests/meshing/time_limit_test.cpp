// The bound on palpate-tetrahedra's processor time: whatever the surface, the program gets there or says in time why not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <random>

#include "formats/errors.h"
#include "formats/processor_limit.h"
#include "formats/tetrahedral_mesh.h"
#include "meshing/tetrahedra/tetrahedra_from_surfaces.h"
#include "tests/meshing/run_surface.h"
#include "tests/meshing/run_tetrahedra.h"
#include "tests/support/closed_surfaces.h"

namespace palpate {
namespace {

using namespace tests;
using testing::AllOf;
using testing::HasSubstr;

TEST(ProcessorLimit, EndsABusyProgramWithItsSentence) {
  EXPECT_EXIT(
      {
        const ProcessorLimit limit("program", processor_seconds() + 0.5, "input.off: too slow;\ntake another");
        for (volatile std::uint64_t turns = 0;;) turns = turns + 1;
      },
      testing::ExitedWithCode(1), "^program: input.off: too slow; take another\n$");
}

TEST(ProcessorLimit, EndsNothingAfterItsEnd) {
  { const ProcessorLimit limit("program", processor_seconds() + 0.2, "too slow"); }
  for (const double end = processor_seconds() + 0.5; processor_seconds() < end;) {
  }
}

// The inputs on which a bound once failed. Each took longer than its row's seconds when only the mesher was limited.

// A ball of spikes: one point of a sphere in each direction, at a random distance.
TriangleSurface spikes(int splits) {
  TriangleSurface ball = sphere_surface(splits, 50);
  std::mt19937 random(1);
  for (Point& p : ball.points) p = (0.05 + 1.95 * static_cast<double>(random() % 10'000) / 10'000) * p;
  return ball;
}

// Two spheres with a gap of a thousandth of the radius: a thin wall.
TriangleSurface thin_wall() {
  TriangleSurface outer = sphere_surface(5, 50), inner = sphere_surface(5, 49.95);
  turn_inside_out(inner);
  append(outer, inner);
  return outer;
}

// Concentric shells, turned outward and inward in turns.
TriangleSurface onion(int shells) {
  TriangleSurface all;
  for (int i = 0; i < shells; ++i) {
    TriangleSurface shell = sphere_surface(1, 50 + 0.05 * i);
    if (i % 2 != (shells - 1) % 2) turn_inside_out(shell);
    append(all, shell);
  }
  return all;
}

struct Row {
  const char* name;
  TriangleSurface surface;
};

double seconds_of_children() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

TEST(TimeLimit, HoldsForSurfacesThatTakeLongAndItsSentenceNamesFilePlaceAndCure) {
  const auto folder = fresh_folder();
  const Row rows[] = {{"box of many equal squares", box_surface(60, {0, 0, 0}, {100, 100, 100})},
                      {"spikes", spikes(5)},
                      {"thin wall", thin_wall()},
                      {"onion", onion(200)}};
  for (const auto& [name, surface] : rows) {
    SCOPED_TRACE(name);
    write_off(folder / "a b.off", surface);
    const double before = seconds_of_children();
    // On no machine does one of them get there so soon.
    const ProgramRun run = run_tetrahedra(folder, "'a b.off' -o a.msh --time-limit 0.3", 1);
    // The limit is checked each 0.1 s of processor time, whatever else the machine does.
    EXPECT_LT(seconds_of_children() - before, 0.3 + 0.5) << run.errors;
    EXPECT_THAT(run.errors,
                AllOf(HasSubstr("a b.off"), HasSubstr("near ("), HasSubstr("--wrap"), HasSubstr("--time-limit 1.2")));
    EXPECT_FALSE(std::filesystem::exists(folder / "a.msh"));
  }
}

// The program's own bound and that of its tries end it about the same time: which is first depends on the machine's load.
TEST(TimeLimit, OfTheTriesGivesTheAdviceOfTheProgramsOwn) {
  const std::vector<ShellInput> box = {{box_surface(60, {0, 0, 0}, {100, 100, 100}), "box.off", "box"}};
  for (const bool keep_surface : {false, true}) {
    SurfaceFillOptions options;
    options.keep_surface = keep_surface;
    options.processor_limit = 0.3, options.processor_used = 1000;
    try {
      tetrahedra_from_surfaces(box, options);
      ADD_FAILURE() << "meshed in no time";
    } catch (const OperationError& refused) {
      EXPECT_THAT(refused.what(),
                  AllOf(HasSubstr("box.off"), HasSubstr("near ("), HasSubstr("--wrap"), HasSubstr("--time-limit 1.2")));
    }
  }
}

TEST(TimeLimit, Is20SecondsAndMoreForManyTrianglesOrASmallSize) {
  const std::vector<ShellInput> ball = {{sphere_surface(3, 50), "ball.off", ""}};
  EXPECT_EQ(default_processor_limit(ball, 0), 20);
  // 1.4 vertices for each cube of that size
  EXPECT_NEAR(default_processor_limit(ball, 1), 2e-4 * 1280 + 5e-4 * 1.4 * enclosed_volume(ball[0].surface), 1e-9);
  const std::vector<ShellInput> fine = {{sphere_surface(7, 50), "ball.off", ""}};
  EXPECT_DOUBLE_EQ(default_processor_limit(fine, 0), 2e-4 * 327'680);
}

}  // namespace
}  // namespace palpate
