// SHA-256 of a stream of bytes (FIPS 180-4), by OpenSSL.
// Layer: base.  Thread: one at a time.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>

struct evp_md_ctx_st;

namespace tandem {

class Sha256 {
 public:
  Sha256();

  void update(std::span<const std::byte> bytes) noexcept;
  /// 64 hexadecimal digits, lower case. Ends the stream: call it once.
  [[nodiscard]] std::string finish();

 private:
  struct Free {
    void operator()(evp_md_ctx_st* context) const noexcept;
  };
  std::unique_ptr<evp_md_ctx_st, Free> context_;
};

/// Digest of one block.
[[nodiscard]] std::string sha256(std::span<const std::byte> bytes);
[[nodiscard]] inline std::string sha256(std::string_view text) {
  return sha256(std::as_bytes(std::span(text)));
}

/// The digest of an open file, from its beginning; its offset stays. Empty: it cannot be read.
[[nodiscard]] std::string sha256_of(int file);

}  // namespace tandem
