// The digest of logs and kernel libraries, over OpenSSL's EVP interface.
#include "base/sha256.hpp"

#include <openssl/evp.h>
#include <unistd.h>

#include <array>

namespace tandem {

void Sha256::Free::operator()(evp_md_ctx_st* context) const noexcept { EVP_MD_CTX_free(context); }

Sha256::Sha256() : context_(EVP_MD_CTX_new()) {
  EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr);
}

void Sha256::update(std::span<const std::byte> bytes) noexcept {
  EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size());
}

std::string Sha256::finish() {
  std::array<unsigned char, 32> digest{};
  EVP_DigestFinal_ex(context_.get(), digest.data(), nullptr);
  constexpr char kHex[] = "0123456789abcdef";
  std::string text;
  for (const unsigned char byte : digest) {
    text += kHex[byte >> 4];
    text += kHex[byte & 15];
  }
  return text;
}

std::string sha256(std::span<const std::byte> bytes) {
  Sha256 hash;
  hash.update(bytes);
  return hash.finish();
}

std::string sha256_of(int file) {
  Sha256 hash;
  std::array<std::byte, 65536> block;
  off_t at = 0;
  for (;;) {
    const ssize_t got = ::pread(file, block.data(), block.size(), at);
    if (got < 0) return {};
    if (got == 0) return hash.finish();
    hash.update(std::span(block).first(static_cast<std::size_t>(got)));
    at += got;
  }
}

}  // namespace tandem
