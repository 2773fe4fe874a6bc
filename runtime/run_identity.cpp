#include "runtime/run_identity.hpp"

#include <algorithm>

namespace tandem::runtime {

namespace {
constexpr std::size_t kMostParts = 4096;  // that are read
}  // namespace

std::string_view RunIdentity::Part::text() const {
  return {name.data(), static_cast<std::size_t>(std::ranges::find(name, '\0') - name.begin())};
}

void RunIdentity::add(std::string_view name, std::string_view what) {
  name = name.substr(0, std::tuple_size_v<decltype(Part::name)>);
  auto it = std::ranges::find(parts_, name, &Part::text);
  if (it == parts_.end()) {
    it = parts_.insert(it, Part{});
    std::ranges::copy(name, it->name.begin());
  }
  const auto take = [&](unsigned char byte) { it->hash = (it->hash ^ byte) * 0x100000001B3U; };
  for (const char letter : what) take(static_cast<unsigned char>(letter));
  take(0xFF);  // no text's: "ab", "c" is not "a", "bc"
}

std::string RunIdentity::difference(const RunIdentity& other) const {
  for (const Part& part : parts_) {
    const Part* its = other.find(part.text());
    if (its == nullptr || its->hash != part.hash) return std::string(part.text());
  }
  for (const Part& part : other.parts_) {
    if (find(part.text()) == nullptr) return std::string(part.text());
  }
  return {};
}

void RunIdentity::archive(Archive& ar) {
  std::uint64_t size = parts_.size();
  ar(size);
  if (ar.reading()) parts_.assign(ar.ok() ? std::min<std::uint64_t>(size, kMostParts) : 0, {});
  ar.raw(parts_.data(), parts_.size() * sizeof(Part));
}

const RunIdentity::Part* RunIdentity::find(std::string_view name) const {
  const auto it = std::ranges::find(parts_, name, &Part::text);
  return it == parts_.end() ? nullptr : &*it;
}

}  // namespace tandem::runtime
