// Every number of a run that can be looked at: sources are images with a layout, and each of their
// numbers is a signal with a running id.
// Layer: studio.  Thread: one at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "hal/image.hpp"
#include "hal/mark_block.hpp"
#include "log/info.hpp"

namespace tandem::studio {

/// Number of a signal. In a run it is never used for another one.
using SignalId = std::uint32_t;

/// One array of a source.
struct SourceField {
  std::string name;  ///< "position_rad"
  std::string unit;  ///< "rad or m"; empty: it has none
  std::string doc;
  hal::FieldType type = hal::FieldType::kF64;
  std::vector<std::string> elements{};  ///< a name each; empty: they are numbered, or there is one
  std::size_t count = 0;
  std::size_t offset = 0;  ///< in the image [bytes]
};

/// An image of the run: "state", "controller/squat".
struct Source {
  std::string name;
  SignalId first = 0;     ///< of its first number
  std::size_t count = 0;  ///< of numbers
  std::size_t bytes = 0;  ///< of its image
  std::vector<SourceField> fields;
  bool there = true;                   ///< false: a controller that has gone
  std::vector<hal::MarkInfo> marks{};  ///< how its numbers are drawn; empty: they are not
};

/// Numbers of all sources together, at most: beyond it a source gets no ids.
inline constexpr std::size_t kMostSignals = 1U << 16U;

class SignalTable {
 public:
  /// @param robot  its joints and sensors name the elements
  explicit SignalTable(log::RunInfo robot) : robot_(std::move(robot)) {}

  /// Adds an image. One that has been there with the same name, fields and counts gets its former
  /// ids again.
  /// @return its index in sources(). Errors: more than kMostSignals numbers in all
  [[nodiscard]] Result<std::size_t> add(const std::string& name, const hal::Layout& layout);
  /// Its numbers are drawn in 3D: MarkSource has the layout.
  void draw(std::size_t source, std::span<const hal::MarkInfo> marks) {
    sources_[source].marks.assign(marks.begin(), marks.end());
  }
  /// It has gone: its ids stay its own.
  void remove(std::size_t source) { sources_[source].there = false; }

  [[nodiscard]] std::span<const Source> sources() const { return sources_; }
  /// Ids that were given: 0 to size() - 1.
  [[nodiscard]] std::size_t size() const { return size_; }
  /// "state.position_rad.LHipSag"; empty: there is none. For people.
  [[nodiscard]] std::string name(SignalId id) const;
  /// The numbers of an image as single floats, in the places of their ids.
  /// @param image  of the source's layout; other sizes write nothing
  /// @param row    size() numbers
  void convert(std::size_t source, std::span<const std::byte> image, std::span<float> row) const;

 private:
  log::RunInfo robot_;
  std::vector<Source> sources_;
  std::size_t size_ = 0;
};

/// "f64", "u8", ….
[[nodiscard]] const char* to_string(hal::FieldType type);

}  // namespace tandem::studio
