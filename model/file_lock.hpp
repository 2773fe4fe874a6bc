// One process at a time: a lock on a file, which the system drops when its holder ends.
// Layer: model.  Thread: non-RT.
#pragma once

#include <functional>
#include <string>

#include "base/result.hpp"

namespace tandem::model {

/// Holds the lock for as long as it lives. Children that are started meanwhile do not hold it.
class FileLock {
 public:
  /// Waits until the lock of `file` is free. The file is made when it is missing, and stays.
  /// @param waiting  called once when another process holds the lock; may be empty
  /// Error: the file cannot be opened or locked.
  [[nodiscard]] static Result<FileLock> take(const std::string& file,
                                             const std::function<void()>& waiting);
  ~FileLock();
  FileLock(FileLock&& other) noexcept : descriptor_(other.descriptor_) { other.descriptor_ = -1; }
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;
  FileLock& operator=(FileLock&&) = delete;

 private:
  explicit FileLock(int descriptor) : descriptor_(descriptor) {}
  int descriptor_;
};

}  // namespace tandem::model
