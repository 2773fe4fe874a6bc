#include "canopen/sdo.hpp"

#include "tests/canopen/wire.hpp"

namespace tandem::canopen {
namespace {

/// Node 5 with a u32, a u16, an i8, and a 17-character string.
struct ServerTest : testing::Test {
  std::uint32_t kp = 0;
  std::uint16_t heartbeat = 50;
  std::int8_t mode = 8;
  ObjectDictionary od{8};
  SdoServer server{od, 5};
  Outbox out;

  void SetUp() override {
    ASSERT_TRUE(od.add(0x2020, 1, kp, kReadWrite));
    ASSERT_TRUE(od.add(0x1017, 0, heartbeat, kReadWrite, {0, 1000}));
    ASSERT_TRUE(od.add(0x6061, 0, mode, kRead));
    ASSERT_TRUE(od.add_string(0x1008, 0, "left leg, board 3"));
  }
  Frames answer(std::initializer_list<int> request) {
    server.receive(wire(0x605, request), out.sink());
    return out.take();
  }
  static Frames reply(std::initializer_list<int> bytes) { return {wire(0x585, bytes)}; }
};

TEST_F(ServerTest, ExpeditedDownloadsOfOneToFourBytes) {
  EXPECT_EQ(answer({0x23, 0x20, 0x20, 0x01, 0x78, 0x56, 0x34, 0x12}),
            reply({0x60, 0x20, 0x20, 0x01, 0, 0, 0, 0}));
  EXPECT_EQ(kp, 0x12345678u);
  EXPECT_EQ(answer({0x2B, 0x17, 0x10, 0x00, 0x64, 0x00, 0, 0}),
            reply({0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0}));
  EXPECT_EQ(heartbeat, 100);
}

TEST_F(ServerTest, ExpeditedDownloadWithoutSizeTakesTheObjectsSize) {
  EXPECT_EQ(answer({0x22, 0x17, 0x10, 0x00, 0x65, 0x00, 0xEE, 0xEE}),
            reply({0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0}));
  EXPECT_EQ(heartbeat, 101);
}

TEST_F(ServerTest, ExpeditedUploadsOfOneToFourBytes) {
  EXPECT_EQ(answer({0x40, 0x17, 0x10, 0x00, 0, 0, 0, 0}),
            reply({0x4B, 0x17, 0x10, 0x00, 0x32, 0x00, 0, 0}));
  EXPECT_EQ(answer({0x40, 0x61, 0x60, 0x00, 0, 0, 0, 0}),
            reply({0x4F, 0x61, 0x60, 0x00, 0x08, 0, 0, 0}));
  kp = 0xA1B2C3D4;
  EXPECT_EQ(answer({0x40, 0x20, 0x20, 0x01, 0, 0, 0, 0}),
            reply({0x43, 0x20, 0x20, 0x01, 0xD4, 0xC3, 0xB2, 0xA1}));
}

TEST_F(ServerTest, SegmentedUploadAlternatesTheToggleAndMarksTheLast) {
  EXPECT_EQ(answer({0x40, 0x08, 0x10, 0x00, 0, 0, 0, 0}),
            reply({0x41, 0x08, 0x10, 0x00, 17, 0, 0, 0}));
  EXPECT_EQ(answer({0x60, 0, 0, 0, 0, 0, 0, 0}), reply({0x00, 'l', 'e', 'f', 't', ' ', 'l', 'e'}));
  EXPECT_EQ(answer({0x70, 0, 0, 0, 0, 0, 0, 0}), reply({0x10, 'g', ',', ' ', 'b', 'o', 'a', 'r'}));
  EXPECT_EQ(answer({0x60, 0, 0, 0, 0, 0, 0, 0}), reply({0x09, 'd', ' ', '3', 0, 0, 0, 0}));
}

TEST_F(ServerTest, SegmentedDownloadOfANumber) {
  EXPECT_EQ(answer({0x21, 0x20, 0x20, 0x01, 4, 0, 0, 0}),
            reply({0x60, 0x20, 0x20, 0x01, 0, 0, 0, 0}));
  EXPECT_EQ(answer({0x0A, 0x11, 0x22, 0, 0, 0, 0, 0}), reply({0x20, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(answer({0x1B, 0x33, 0x44, 0, 0, 0, 0, 0}), reply({0x30, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(kp, 0x44332211u);
}

TEST_F(ServerTest, AbortsNameTheObjectAndTheCause) {
  EXPECT_EQ(answer({0x40, 0x00, 0x70, 0x00, 0, 0, 0, 0}),  // 0602 0000: no object
            reply({0x80, 0x00, 0x70, 0x00, 0x00, 0x00, 0x02, 0x06}));
  EXPECT_EQ(answer({0x40, 0x20, 0x20, 0x09, 0, 0, 0, 0}),  // 0609 0011: no sub-index
            reply({0x80, 0x20, 0x20, 0x09, 0x11, 0x00, 0x09, 0x06}));
  EXPECT_EQ(answer({0x2F, 0x61, 0x60, 0x00, 1, 0, 0, 0}),  // 0601 0002: read-only
            reply({0x80, 0x61, 0x60, 0x00, 0x02, 0x00, 0x01, 0x06}));
  EXPECT_EQ(answer({0x23, 0x17, 0x10, 0x00, 1, 0, 0, 0}),  // 0607 0012: too long
            reply({0x80, 0x17, 0x10, 0x00, 0x12, 0x00, 0x07, 0x06}));
  EXPECT_EQ(answer({0x2F, 0x17, 0x10, 0x00, 1, 0, 0, 0}),  // 0607 0013: too short
            reply({0x80, 0x17, 0x10, 0x00, 0x13, 0x00, 0x07, 0x06}));
  EXPECT_EQ(answer({0x2B, 0x17, 0x10, 0x00, 0xE9, 0x03, 0, 0}),  // 0609 0031: too high
            reply({0x80, 0x17, 0x10, 0x00, 0x31, 0x00, 0x09, 0x06}));
  EXPECT_EQ(answer({0xC6, 0x17, 0x10, 0x00, 0, 0, 0, 0}),  // 0504 0001: block transfer
            reply({0x80, 0x17, 0x10, 0x00, 0x01, 0x00, 0x04, 0x05}));
  EXPECT_EQ(heartbeat, 50);
}

TEST_F(ServerTest, AWrongToggleAborts) {
  (void)answer({0x40, 0x08, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_EQ(answer({0x70, 0, 0, 0, 0, 0, 0, 0}),
            reply({0x80, 0x08, 0x10, 0x00, 0x00, 0x00, 0x03, 0x05}));
  EXPECT_EQ(answer({0x60, 0, 0, 0, 0, 0, 0, 0}),  // the transfer is over
            reply({0x80, 0x08, 0x10, 0x00, 0x01, 0x00, 0x04, 0x05}));
}

TEST_F(ServerTest, ASegmentedTransferTimesOut) {
  (void)answer({0x21, 0x20, 0x20, 0x01, 4, 0, 0, 0});
  server.process(499 * canopen::kNsPerMs, out.sink());
  EXPECT_TRUE(out.take().empty());
  server.process(1 * canopen::kNsPerMs, out.sink());
  EXPECT_EQ(out.take(), reply({0x80, 0x20, 0x20, 0x01, 0x00, 0x00, 0x04, 0x05}));
  server.process(1000 * canopen::kNsPerMs, out.sink());
  EXPECT_TRUE(out.take().empty());
}

TEST_F(ServerTest, ADownloadOfAnotherLengthThanAnnouncedAborts) {
  (void)answer({0x21, 0x20, 0x20, 0x01, 5, 0, 0, 0});
  EXPECT_EQ(answer({0x07, 1, 2, 3, 4, 0, 0, 0}),
            reply({0x80, 0x20, 0x20, 0x01, 0x10, 0x00, 0x07, 0x06}));
}

TEST_F(ServerTest, IgnoresOthersFramesAndShortOnes) {
  server.receive(wire(0x606, {0x40, 0x17, 0x10, 0x00, 0, 0, 0, 0}), out.sink());
  server.receive(wire(0x605, {0x40, 0x17, 0x10}), out.sink());
  EXPECT_TRUE(out.take().empty());
}

struct ClientTest : testing::Test {
  SdoClient client{5};
  Outbox out;

  Frames on(std::initializer_list<int> answer) {
    client.receive(wire(0x585, answer), out.sink());
    return out.take();
  }
  static Frames request(std::initializer_list<int> bytes) { return {wire(0x605, bytes)}; }
};

TEST_F(ClientTest, ExpeditedDownload) {
  const std::uint8_t value[] = {0x64, 0x00};
  client.download(0x1017, 0, value, out.sink());
  EXPECT_EQ(out.take(), request({0x2B, 0x17, 0x10, 0x00, 0x64, 0x00, 0, 0}));
  EXPECT_EQ(client.status(), SdoClient::Status::kBusy);
  EXPECT_TRUE(on({0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0}).empty());
  EXPECT_EQ(client.status(), SdoClient::Status::kDone);
}

TEST_F(ClientTest, SegmentedDownload) {
  const std::uint8_t value[] = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  client.download(0x2200, 1, value, out.sink());
  EXPECT_EQ(out.take(), request({0x21, 0x00, 0x22, 0x01, 9, 0, 0, 0}));
  EXPECT_EQ(on({0x60, 0x00, 0x22, 0x01, 0, 0, 0, 0}), request({0x00, 1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(on({0x20, 0, 0, 0, 0, 0, 0, 0}), request({0x1B, 8, 9, 0, 0, 0, 0, 0}));
  EXPECT_TRUE(on({0x30, 0, 0, 0, 0, 0, 0, 0}).empty());
  EXPECT_EQ(client.status(), SdoClient::Status::kDone);
}

TEST_F(ClientTest, ExpeditedUpload) {
  client.upload(0x1018, 1, out.sink());
  EXPECT_EQ(out.take(), request({0x40, 0x18, 0x10, 0x01, 0, 0, 0, 0}));
  EXPECT_TRUE(on({0x43, 0x18, 0x10, 0x01, 0x4D, 0x7A, 0, 0}).empty());
  ASSERT_EQ(client.status(), SdoClient::Status::kDone);
  EXPECT_EQ(std::vector<int>(client.value().begin(), client.value().end()),
            (std::vector<int>{0x4D, 0x7A, 0, 0}));
}

TEST_F(ClientTest, SegmentedUpload) {
  client.upload(0x1008, 0, out.sink());
  (void)out.take();
  EXPECT_EQ(on({0x41, 0x08, 0x10, 0x00, 9, 0, 0, 0}), request({0x60, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(on({0x00, 'l', 'e', 'f', 't', ' ', 'l', 'e'}), request({0x70, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_TRUE(on({0x1B, 'g', '!', 0, 0, 0, 0, 0}).empty());
  ASSERT_EQ(client.status(), SdoClient::Status::kDone);
  EXPECT_EQ(std::string(client.value().begin(), client.value().end()), "left leg!");
}

TEST_F(ClientTest, TellsTheServersAbort) {
  client.upload(0x7000, 0, out.sink());
  (void)out.take();
  EXPECT_TRUE(on({0x80, 0x00, 0x70, 0x00, 0x00, 0x00, 0x02, 0x06}).empty());
  EXPECT_EQ(client.status(), SdoClient::Status::kAborted);
  EXPECT_EQ(client.abort_code(), AbortCode::kNoObject);
}

TEST_F(ClientTest, AbortsWhenNoAnswerComes) {
  client.upload(0x1018, 1, out.sink());
  (void)out.take();
  client.process(99 * canopen::kNsPerMs, 100 * canopen::kNsPerMs, out.sink());
  EXPECT_EQ(client.status(), SdoClient::Status::kBusy);
  client.process(1 * canopen::kNsPerMs, 100 * canopen::kNsPerMs, out.sink());
  EXPECT_EQ(client.status(), SdoClient::Status::kAborted);
  EXPECT_EQ(client.abort_code(), AbortCode::kTimeout);
  EXPECT_EQ(out.take(), request({0x80, 0x18, 0x10, 0x01, 0x00, 0x00, 0x04, 0x05}));
}

TEST_F(ClientTest, AbortsOnAWrongToggle) {
  client.upload(0x1008, 0, out.sink());
  (void)on({0x41, 0x08, 0x10, 0x00, 9, 0, 0, 0});
  EXPECT_EQ(on({0x10, 'l', 'e', 'f', 't', ' ', 'l', 'e'}),
            request({0x80, 0x08, 0x10, 0x00, 0x00, 0x00, 0x03, 0x05}));
}

TEST_F(ClientTest, PassesOverAnswersOfAnotherKind) {
  client.upload(0x1008, 0, out.sink());
  (void)out.take();
  EXPECT_TRUE(on({0x60, 0x08, 0x10, 0x00, 0, 0, 0, 0}).empty()) << "a download's";
  EXPECT_TRUE(on({0x20, 0x00, 0x00, 0x00, 0, 0xC0, 0, 0}).empty()) << "a segment's";
  EXPECT_EQ(client.status(), SdoClient::Status::kBusy);
  (void)on({0x41, 0x08, 0x10, 0x00, 9, 0, 0, 0});
  EXPECT_TRUE(on({0x41, 0x08, 0x10, 0x00, 9, 0, 0, 0}).empty()) << "the same once more";
  EXPECT_EQ(client.status(), SdoClient::Status::kBusy);
}

TEST_F(ClientTest, TakesAnAnswerWithoutSizeAndOneThatEndsWithItsValue) {
  client.upload(0x6041, 0, out.sink());
  (void)on({0x42, 0x41, 0x60, 0x00, 0x37, 0x02, 0, 0});
  EXPECT_EQ(client.value().size(), 4U);
  client.upload(0x1402, 2, out.sink());
  (void)on({0x4F, 0x02, 0x14, 0x02, 0xFE});
  ASSERT_EQ(client.status(), SdoClient::Status::kDone);
  ASSERT_EQ(client.value().size(), 1U);
  EXPECT_EQ(client.value()[0], 0xFE);
  client.upload(0x1402, 1, out.sink());
  (void)on({0x43, 0x02, 0x14, 0x01, 0x05});
  EXPECT_EQ(client.value().size(), 1U) << "it says four bytes and has one";
}

TEST_F(ClientTest, PassesOverLateAnswersAboutAnotherObject) {
  client.upload(0x1018, 2, out.sink());
  (void)out.take();
  EXPECT_TRUE(on({0x43, 0x18, 0x10, 0x01, 0x4D, 0x7A, 0, 0}).empty());
  EXPECT_EQ(client.status(), SdoClient::Status::kBusy);
}

}  // namespace
}  // namespace tandem::canopen
