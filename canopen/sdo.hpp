// Service data objects: the server of a node and the client of the master.
// Layer: canopen.  Thread: the one that owns the object.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/realtime.hpp"
#include "canopen/abort_code.hpp"
#include "canopen/frame.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/objects.hpp"

namespace tandem::canopen {

/// The longest value that a segmented transfer can have here.
inline constexpr std::size_t kMaxSdoBytes = 256;
/// After how long without the partner's next frame a transfer is aborted.
inline constexpr std::int64_t kSdoTimeoutNs = 500'000'000;

/// One transfer at a time, expedited or segmented, of the entries of an object dictionary.
class SdoServer {
 public:
  SdoServer(ObjectDictionary& od, int node_id) noexcept : od_(&od), node_(node_id) {}

  /// Answers a request of the client. Frames that are not for this server are ignored.
  void receive(const Frame& frame, FrameSink& out) noexcept TANDEM_RT;
  /// Aborts a segmented transfer that the client does not go on with.
  void process(std::int64_t dt_ns, FrameSink& out) noexcept TANDEM_RT;
  /// Forgets a transfer under way.
  void reset() noexcept { transfer_ = Transfer::kNone; }
  void archive(Archive& ar);

 private:
  enum class Transfer : std::uint8_t { kNone, kDownload, kUpload };

  void begin_download(const Frame& request, FrameSink& out) noexcept;
  void download_segment(const Frame& request, FrameSink& out) noexcept;
  void begin_upload(const Frame& request, FrameSink& out) noexcept;
  void upload_segment(const Frame& request, FrameSink& out) noexcept;
  void abort(AbortCode code, FrameSink& out) noexcept;
  [[nodiscard]] Frame response(std::uint8_t command) const noexcept;
  [[nodiscard]] Frame initiate_response(std::uint8_t command) const noexcept;

  ObjectDictionary* od_;
  int node_;
  Transfer transfer_ = Transfer::kNone;
  bool toggle_ = false;
  std::uint16_t index_ = 0;
  std::uint8_t sub_ = 0;
  std::uint32_t announced_ = 0;  ///< size that the client gave, 0 when it gave none
  std::size_t length_ = 0;       ///< bytes in the buffer
  std::size_t position_ = 0;     ///< bytes of them sent (upload)
  std::int64_t idle_ns_ = 0;
  std::array<std::uint8_t, kMaxSdoBytes> buffer_{};
};

/// One transfer at a time with one server.
class SdoClient {
 public:
  enum class Status : std::uint8_t {
    kIdle,     ///< nothing was asked for yet
    kBusy,     ///< a transfer is under way
    kDone,     ///< the value has arrived, there or here
    kAborted,  ///< abort_code() says why
  };

  explicit SdoClient(int server_node) noexcept : node_(server_node) {}

  /// Starts writing `value`; the first frame goes to `out`. A transfer under way is forgotten.
  /// @pre value.size() is 1 to kMaxSdoBytes.
  void download(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> value,
                FrameSink& out) noexcept TANDEM_RT;
  /// Starts reading.
  void upload(std::uint16_t index, std::uint8_t sub, FrameSink& out) noexcept TANDEM_RT;

  /// Takes an answer of the server. Frames of others, and late answers about another object than
  /// the one asked for, are ignored.
  void receive(const Frame& frame, FrameSink& out) noexcept TANDEM_RT;
  /// Aborts with kTimeout when no answer came for `timeout_ns`.
  void process(std::int64_t dt_ns, std::int64_t timeout_ns, FrameSink& out) noexcept TANDEM_RT;

  [[nodiscard]] Status status() const noexcept { return status_; }
  [[nodiscard]] AbortCode abort_code() const noexcept { return abort_code_; }
  [[nodiscard]] std::uint16_t index() const noexcept { return index_; }
  [[nodiscard]] std::uint8_t sub() const noexcept { return sub_; }
  /// The value that an upload brought.
  [[nodiscard]] std::span<const std::uint8_t> value() const noexcept {
    return {buffer_.data(), length_};
  }
  void archive(Archive& ar);

 private:
  void on_download(const Frame& frame, FrameSink& out) noexcept;
  void on_upload(const Frame& frame, FrameSink& out) noexcept;
  void on_upload_segment(const Frame& frame, FrameSink& out) noexcept;
  void send_download_segment(FrameSink& out) noexcept;
  void start(std::uint16_t index, std::uint8_t sub, bool uploading) noexcept;
  void fail(AbortCode code, FrameSink& out) noexcept;
  [[nodiscard]] bool answers(const Frame& frame) const noexcept;
  [[nodiscard]] Frame request(std::uint8_t command) const noexcept;
  [[nodiscard]] Frame initiate_request(std::uint8_t command) const noexcept;

  int node_;
  Status status_ = Status::kIdle;
  bool uploading_ = false;
  bool segmented_ = false;  ///< the initiate phase is over
  bool toggle_ = false;
  std::uint16_t index_ = 0;
  std::uint8_t sub_ = 0;
  AbortCode abort_code_ = AbortCode::kNone;
  std::uint32_t announced_ = 0;
  std::size_t length_ = 0;
  std::size_t position_ = 0;
  std::int64_t idle_ns_ = 0;
  std::array<std::uint8_t, kMaxSdoBytes> buffer_{};
};

}  // namespace tandem::canopen
