// Sums the law of ground_law.hpp over every sole's points into one wrench in the site's axes.
#include "hal/sim/contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hal/sim/ground_law.hpp"
#include "hal/sim/rotation.hpp"

namespace tandem::sim {
namespace {

std::unexpected<Error> bad(const char* key, const char* message, const char* hint) {
  return std::unexpected(Error{.message = message, .hint = hint, .file = {}, .key = key});
}

}  // namespace

Result<Contact> Contact::create(const hal::ContactConfig& config, const std::vector<Sole>& feet) {
  Contact contact;
  contact.config_ = config;
  if (feet.empty()) return contact;
  if (!(config.stiffness_N_m > 0.0)) {
    return bad("contact.stiffness_N_m", "feet need ground of a stiffness above 0",
               "[N/m] per point");
  }
  if (!(config.tangential_stiffness_N_m > 0.0)) {
    return bad("contact.tangential_stiffness_N_m", "feet that stick need a stiffness above 0",
               "[N/m] per point");
  }
  if (!(config.damping_s_m >= 0.0) || !(config.tangential_damping_Ns_m >= 0.0)) {
    return bad("contact.damping_s_m", "damping cannot be negative", "0 or more");
  }
  if (!(config.sliding_friction >= 0.0) || !(config.static_friction >= config.sliding_friction)) {
    return bad("contact.static_friction", "static friction is below sliding friction",
               "both are 0 or more, static the larger");
  }
  if (!(config.stick_velocity_m_s > 0.0)) {
    return bad("contact.stick_velocity_m_s", "has to be above 0", "0.01 is usual");
  }
  for (const Sole& foot : feet) {
    const std::size_t begin = contact.x_.size();
    for (const std::array<double, 3>& point : foot.points_m) {
      contact.x_.push_back(point[0]);
      contact.y_.push_back(point[1]);
      contact.z_.push_back(point[2]);
    }
    contact.feet_.push_back({foot.site, foot.wrench, begin, contact.x_.size()});
  }
  contact.anchor_x_.assign(contact.points(), 0.0);
  contact.anchor_y_.assign(contact.points(), 0.0);
  contact.touching_.assign(contact.points(), 0);
  contact.wrench_W_.assign(6 * contact.feet(), 0.0);
  return contact;
}

void Contact::evaluate(const double* pose, const double* twist, bool move_anchors,
                       double* wrench) noexcept TANDEM_RT {
  const PointGround ground{.stiffness_N_m = config_.stiffness_N_m,
                           .damping_s_m = config_.damping_s_m,
                           .tangential_stiffness_N_m = config_.tangential_stiffness_N_m,
                           .tangential_damping_Ns_m = config_.tangential_damping_Ns_m};
  energy_J_ = 0.0;
  for (std::size_t f = 0; f < feet_.size(); ++f) {
    const SolePoints& foot = feet_[f];
    const double* R = pose + 12 * foot.site;
    const double* p = R + 9;
    const double* v = twist + 6 * foot.site;
    const double* w = v + 3;
    double F[3] = {0.0, 0.0, 0.0};
    double M[3] = {0.0, 0.0, 0.0};  // W axes, about the site's origin
    for (std::size_t i = foot.begin; i < foot.end; ++i) {
      const double x = R[0] * x_[i] + R[1] * y_[i] + R[2] * z_[i];
      const double y = R[3] * x_[i] + R[4] * y_[i] + R[5] * z_[i];
      const double z = R[6] * x_[i] + R[7] * y_[i] + R[8] * z_[i];
      const PointMotion point{p[0] + x,
                              p[1] + y,
                              p[2] + z,
                              v[0] + w[1] * z - w[2] * y,
                              v[1] + w[2] * x - w[0] * z,
                              v[2] + w[0] * y - w[1] * x};
      const std::array<double, 3> force_W =
          ground_force(config_, moved_, ground, point, move_anchors,
                       {&anchor_x_[i], &anchor_y_[i], &touching_[i]}, energy_J_);
      F[0] += force_W[0];
      F[1] += force_W[1];
      F[2] += force_W[2];
      M[0] += y * force_W[2] - z * force_W[1];
      M[1] += z * force_W[0] - x * force_W[2];
      M[2] += x * force_W[1] - y * force_W[0];
    }
    write(f, R, F, M, wrench);
  }
}

double Contact::rise_m(const double* pose) const noexcept {
  double rise = -std::numeric_limits<double>::infinity();
  for (const SolePoints& foot : feet_) {
    const double* R = pose + 12 * foot.site;
    for (std::size_t i = foot.begin; i < foot.end; ++i) {
      const double in_site[3] = {x_[i], y_[i], z_[i]};
      const Vec3 way = rotate(R, in_site);
      rise = std::max(rise, config_.terrain.at(R[9] + way[0], R[10] + way[1]).height_m);
    }
  }
  return std::isfinite(rise) ? rise : config_.terrain.at(0.0, 0.0).height_m;
}

void Contact::take(const double* pose, const double* forces_W, double* wrench) noexcept {
  for (std::size_t f = 0; f < feet_.size(); ++f) {
    const double* R = pose + 12 * feet_[f].site;
    Vec3 F{}, M{};
    for (std::size_t i = feet_[f].begin; i < feet_[f].end; ++i) {
      const double in_site[3] = {x_[i], y_[i], z_[i]};
      const auto [x, y, z] = rotate(R, in_site);
      const double* force = forces_W + 3 * i;
      for (std::size_t axis = 0; axis < 3; ++axis) F[axis] += force[axis];
      M[0] += y * force[2] - z * force[1];
      M[1] += z * force[0] - x * force[2];
      M[2] += x * force[1] - y * force[0];
      touching_[i] = force[2] > 0.0 ? 1 : 0;
    }
    write(f, R, F.data(), M.data(), wrench);
  }
}

void Contact::write(std::size_t f, const double* R, const double* F, const double* M,
                    double* wrench) noexcept {
  double* out = wrench + 6 * feet_[f].wrench;
  double* out_W = wrench_W_.data() + 6 * f;
  for (int axis = 0; axis < 3; ++axis) {
    out[axis] = R[axis] * F[0] + R[3 + axis] * F[1] + R[6 + axis] * F[2];
    out[3 + axis] = R[axis] * M[0] + R[3 + axis] * M[1] + R[6 + axis] * M[2];
    out_W[axis] = F[axis];
    out_W[3 + axis] = M[axis];
  }
}

}  // namespace tandem::sim
