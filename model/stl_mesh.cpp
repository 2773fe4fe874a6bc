#include "model/stl_mesh.hpp"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace tandem::model {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kHeader = 84;  // 80 bytes of text, and the count
constexpr std::size_t kFacet = 50;   // a normal, three corners, two bytes more

constexpr std::uint32_t kMostFacets = 1U << 28;  // four letters of a text make a larger number

static_assert(std::endian::native == std::endian::little, "STL is little-endian");

Result<std::vector<Triangle>> parse_binary(std::string_view bytes, std::size_t count) {
  std::vector<Triangle> all(count);
  const char* at = bytes.data() + kHeader;
  for (Triangle& one : all) {
    float numbers[12];
    std::memcpy(numbers, at, sizeof numbers);
    at += kFacet;
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const float* const p = numbers + 3 + 3 * corner;
      one[corner] = {p[0], p[1], p[2]};
      if (!one[corner].allFinite()) return fail("the mesh has a corner that is not finite");
    }
  }
  return all;
}

/// "vertex 1 2 3", again and again.
Result<std::vector<Triangle>> parse_text(std::string_view text) {
  std::vector<Triangle> all;
  Triangle next;
  std::size_t corners = 0, at = 0;
  constexpr std::string_view kWord = "vertex";
  while ((at = text.find(kWord, at)) != std::string_view::npos) {
    at += kWord.size();
    for (Eigen::Index i = 0; i < 3; ++i) {
      at = std::min(text.find_first_not_of(" \t\r\n+", at), text.size());
      const auto read =
          std::from_chars(text.data() + at, text.data() + text.size(), next[corners][i]);
      if (read.ec != std::errc{} || !std::isfinite(next[corners][i]))
        return fail("the mesh has a corner that is no number");
      at = static_cast<std::size_t>(read.ptr - text.data());
    }
    if (++corners < 3) continue;
    all.push_back(next);
    corners = 0;
  }
  if (all.empty()) return fail("this is no STL");
  return all;
}

}  // namespace

Result<std::vector<Triangle>> parse_stl(std::string_view bytes) {
  std::uint32_t count = 0;
  if (bytes.size() >= kHeader) std::memcpy(&count, bytes.data() + 80, sizeof count);
  // Binary files may begin with "solid", too, so their size decides.
  if (count > 0 && bytes.size() >= kHeader && (bytes.size() - kHeader) / kFacet >= count)
    return parse_binary(bytes, count);
  if (bytes.starts_with("solid")) {
    auto text = parse_text(bytes);
    if (text || count == 0 || count > kMostFacets) return text;
  }
  const bool cut = count > 0 && count <= kMostFacets;
  return fail(cut ? "the STL is cut off" : "this is no STL");
}

Inertia solid_within(const std::vector<Triangle>& surface, double density_kg_m3) {
  double volume = 0.0;
  Vector3d first = Vector3d::Zero();   // integral of x
  Matrix3d second = Matrix3d::Zero();  // integral of x x^T
  const Vector3d middle = surface.empty() ? Vector3d::Zero().eval() : surface[0][0];
  for (const Triangle& one : surface) {  // the tetrahedron from `middle` to the triangle
    const Vector3d a = one[0] - middle, b = one[1] - middle, c = one[2] - middle;
    const double v = a.dot(b.cross(c)) / 6.0;
    const Vector3d sum = a + b + c;
    volume += v;
    first += v / 4.0 * sum;
    second += v / 20.0 *
              (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
  }
  const double mass = density_kg_m3 * std::abs(volume);  // negative: its normals look inwards
  if (!(mass > 0.0)) return {};
  const Vector3d com = first / volume;
  const Matrix3d J = mass * (second / volume - com * com.transpose());
  return {mass, middle + com, J.trace() * Matrix3d::Identity() - J};
}

}  // namespace tandem::model
