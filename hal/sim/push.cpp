#include "hal/sim/push.hpp"

#include <algorithm>

#include "hal/sim/push_row.hpp"

namespace tandem::sim {

Pushes::Pushes(const model::Tree& tree, const tandem_kernels& kernels,
               const std::vector<std::string>& joints)
    : motion_(tree, kernels),
      body_force_(6 * motion_.bodies().size()),
      pushes_(FaultInjection::kMostFaults) {
  for (const std::string& name : joints)
    body_of_joint_.push_back(static_cast<std::size_t>(tree.joint_index(name) + 1));
  for (const model::Link& link : tree.links)
    body_of_link_.push_back(static_cast<std::size_t>(link.body));
}

void Pushes::begin(const ScenarioFault& push, std::int64_t time_ns) noexcept TANDEM_RT {
  const std::vector<std::size_t>& bodies = push.link >= 0 ? body_of_link_ : body_of_joint_;
  const auto place = static_cast<std::size_t>(push.link >= 0 ? push.link : push.joint);
  if (place >= bodies.size() || count_ == pushes_.size()) return;
  pushes_[count_++] = {.given = push, .begin_ns = time_ns, .body = bodies[place]};
}

void Pushes::act_on(std::int64_t time_ns, std::int64_t step_ns) noexcept TANDEM_RT {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    Push& push = pushes_[i];
    const std::int64_t lasts_ns = push.given.duration_ns, since_ns = time_ns - push.begin_ns;
    if (lasts_ns >= 0 && since_ns >= lasts_ns) continue;
    const bool whole = lasts_ns < 0 || since_ns + step_ns <= lasts_ns;
    if (push.given.shape == PushShape::kStep) {
      const std::int64_t of_it_ns = whole ? step_ns : lasts_ns - since_ns;
      push.share = static_cast<double>(of_it_ns) / static_cast<double>(step_ns);
    } else {
      const auto lasts = static_cast<double>(lasts_ns), since = static_cast<double>(since_ns);
      const auto step = static_cast<double>(step_ns);
      push.share =
          (area(push.given.shape, (since + step) / lasts) - area(push.given.shape, since / lasts)) *
          lasts / step;
    }
    pushes_[kept++] = push;
  }
  count_ = kept;
}

/// The forces on bodies, six each, about W's origin.
void Pushes::place(const double* q, const double* v) noexcept TANDEM_RT {
  motion_.place(q, v);
  std::ranges::fill(body_force_, 0.0);
  for (std::size_t i = 0; i < count_; ++i) {
    const Push& push = pushes_[i];
    const TreeMotion::BodyMotion& at = motion_.bodies()[push.body];
    Vec3 force = push.given.force_N, torque = push.given.torque_Nm;
    if (push.given.turns != 0) {
      force = rotate(at.R.data(), force.data());
      torque = rotate(at.R.data(), torque.data());
    }
    for (double& one : force) one *= push.share;
    const Vec3 arm = sum(at.p, rotate(at.R.data(), push.given.point_m.data()));
    const Vec3 moment = cross(arm, force);
    for (std::size_t k = 0; k < 3; ++k) {
      body_force_[6 * push.body + k] += force[k];
      body_force_[6 * push.body + 3 + k] += moment[k] + push.share * torque[k];
    }
  }
}

void Pushes::add_forces(const double* q, const double* v, double* forces) noexcept TANDEM_RT {
  place(q, v);
  motion_.add_generalized(body_force_.data(), forces);
}

void Pushes::sum_up(const double* q, const double* v, const double* center_m, double* force_N,
                    double* moment_Nm) noexcept TANDEM_RT {
  std::fill_n(force_N, 3, 0.0);
  std::fill_n(moment_Nm, 3, 0.0);
  if (count_ == 0) return;
  place(q, v);
  for (std::size_t b = 0; b < motion_.bodies().size(); ++b) {
    for (std::size_t k = 0; k < 3; ++k) {
      force_N[k] += body_force_[6 * b + k];
      moment_Nm[k] += body_force_[6 * b + 3 + k];
    }
  }
  const Vec3 moved =
      cross({center_m[0], center_m[1], center_m[2]}, {force_N[0], force_N[1], force_N[2]});
  for (std::size_t k = 0; k < 3; ++k) moment_Nm[k] -= moved[k];
}

/// Only what is in use: what the array held before is no state.
void Pushes::archive(Archive& ar) {
  ar(count_);
  count_ = std::min(count_, pushes_.size());
  for (std::size_t i = 0; i < count_; ++i) ar(pushes_[i]);
}

}  // namespace tandem::sim
