// Newton's method on the contact laws. Its equations have kinks where contacts release, stick and slip.
// Source: Alart and Curnier, "A mixed formulation for frictional contact problems prone to Newton like solution methods",
// Computer Methods in Applied Mechanics and Engineering 92(3), 1991.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/contact_laws.h"
#include "runtime/contact/shared_newton.h"

namespace palpate {

class LawNewton {
 public:
  // A larger system has no Newton step: its factor alone would cost more than a step of the scene may.
  static constexpr std::int32_t kMostRows = 576;

  // rows: of the largest system; contact_nodes: of systems with shared nodes, or 0. Memory: at most 8 kMostRows^2 bytes, 96 bytes per
  // row, and what SharedNewton takes.
  bool create(SceneMemory& memory, std::int32_t rows, std::int32_t contact_nodes);

  // Call it before the first step on a system, and where something else has moved the reactions.
  void begin() { recent_[0] = recent_[1] = recent_[2] = 0; }
  // The next step computes a new factor. Call it where the matrix of the system has changed.
  void forget() { size_ = -1; }

  // Moves the reactions, and `ahead` with them, in Newton's direction: by the whole of it, a half, a quarter or an eighth. False
  // where none of these brings the laws' equations closer to zero, where the system is too large, or where the step would cost
  // more than `operations`; all that has changed then is that contacts which the laws release have no force.
  // The factor is kept while each step with it at least halves the error.
  // operations: multiply-adds that may be spent; reduced by those that were.
  bool step(const ContactSystem& system, double* reaction, double* ahead, std::int64_t* operations);

 private:
  // An equation for each row of a contact that is not released.
  struct Equation {
    std::int32_t constraint, axis;
  };
  bool list_equations(const ContactSystem& system, double* reaction, double* ahead);
  // The derivative of a constraint's equations: `weight` times that of ahead, and `beside` on the constraint's own reactions.
  struct Derivative {
    Mat3 weight, beside;
  };
  static Derivative derivative_of(const ContactSystem& system, std::int32_t p, Vec3 r, Vec3 ahead);
  bool goes_through_nodes(const ContactSystem& system) const;
  std::int64_t operations_to_factor(const ContactSystem& system) const;
  std::int64_t operations_to_solve(const ContactSystem& system) const;
  bool factor(const ContactSystem& system, const double* reaction, const double* ahead);
  bool factor_shared(const ContactSystem& system, const double* reaction, const double* ahead);
  void write_equation(const ContactSystem& system, Equation equation, const Derivative& derivative, double* to) const;
  void find_direction(const ContactSystem& system, const double* reaction, const double* ahead);
  bool move(const ContactSystem& system, bool is_new, double* reaction, double* ahead);
  double error(const ContactSystem& system, const double* reaction, const double* ahead) const;

  std::int32_t capacity_ = 0;      // equations
  std::size_t stride_ = 0;         // numbers per row of the factor
  double* factor_ = nullptr;       // [capacity][stride]
  double* solution_ = nullptr;     // [capacity] N
  Equation* equations_ = nullptr;  // [capacity]
  double* change_ = nullptr;       // [rows] N, the direction
  double* further_ = nullptr;      // [rows] m, what the direction adds to `ahead`
  double* trial_ = nullptr;        // [2][rows]
  SharedNewton shared_;
  bool through_nodes_ = false;  // the factor is one over the nodes
  std::int32_t count_ = 0;      // equations
  std::int32_t size_ = -1;      // equations of the factor; -1: none
  double recent_[3] = {};       // m, the errors of the last three steps
};

}  // namespace palpate
