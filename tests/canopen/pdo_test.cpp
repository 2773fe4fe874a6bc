#include "canopen/pdo.hpp"

#include "tests/canopen/wire.hpp"

namespace tandem::canopen {
namespace {

struct PdoFixture : testing::Test {
  std::uint16_t control = 0;
  std::int8_t mode = 0;
  std::int32_t target = 0;
  std::uint16_t status = 0x1637;
  std::int32_t actual = -2;
  std::array<std::uint32_t, 16> wide{};
  ObjectDictionary od{200};
  RxPdo rpdo;
  TxPdo tpdo;
  Outbox out;

  void SetUp() override {
    ASSERT_TRUE(od.add(0x6040, 0, control, kWriteRpdo));
    ASSERT_TRUE(od.add(0x6060, 0, mode, kWriteRpdo));
    ASSERT_TRUE(od.add(0x607A, 0, target, kWriteRpdo));
    ASSERT_TRUE(od.add(0x6041, 0, status, kReadTpdo));
    ASSERT_TRUE(od.add(0x6064, 0, actual, kReadTpdo));
    for (std::uint8_t i = 0; i < wide.size(); ++i) {
      ASSERT_TRUE(od.add(0x2100, static_cast<std::uint8_t>(i + 1), wide[i], kReadTpdo));
    }
    ASSERT_TRUE(rpdo.add_to(od, PdoDirection::kReceive, 1, 5));
    ASSERT_TRUE(tpdo.add_to(od, PdoDirection::kTransmit, 1, 5));
  }
  AbortCode write32(std::uint16_t index, std::uint8_t sub, std::uint32_t value) {
    std::array<std::uint8_t, 4> bytes{};
    put(bytes.data(), value);
    return od.write(index, sub, bytes);
  }
  AbortCode write8(std::uint16_t index, std::uint8_t sub, std::uint8_t value) {
    return od.write(index, sub, {&value, 1});
  }
  void map_rpdo(std::uint8_t type) {
    ASSERT_EQ(write32(0x1600, 1, 0x60400010), AbortCode::kNone);
    ASSERT_EQ(write32(0x1600, 2, 0x60600008), AbortCode::kNone);
    ASSERT_EQ(write32(0x1600, 3, 0x607A0020), AbortCode::kNone);
    ASSERT_EQ(write8(0x1600, 0, 3), AbortCode::kNone);
    ASSERT_EQ(write8(0x1400, 2, type), AbortCode::kNone);
    ASSERT_EQ(write32(0x1400, 1, 0x205), AbortCode::kNone);
  }
  void map_tpdo(std::uint8_t type) {
    ASSERT_EQ(write32(0x1A00, 1, 0x60410010), AbortCode::kNone);
    ASSERT_EQ(write32(0x1A00, 2, 0x60640020), AbortCode::kNone);
    ASSERT_EQ(write8(0x1A00, 0, 2), AbortCode::kNone);
    ASSERT_EQ(write8(0x1800, 2, type), AbortCode::kNone);
    ASSERT_EQ(write32(0x1800, 1, 0x40000185), AbortCode::kNone);
  }
};

const Frame kCommand = wire(0x205, {0x0F, 0x00, 0xFF, 0x78, 0x56, 0x34, 0x12});
const Frame kFeedback = wire(0x185, {0x37, 0x16, 0xFE, 0xFF, 0xFF, 0xFF});

TEST_F(PdoFixture, IsNotInUseUntilItsCobIdIsSet) {
  EXPECT_EQ(rpdo.receive(kCommand), RxPdo::Taken::kNotMine);
  tpdo.sync(out.sink());
  EXPECT_TRUE(out.take().empty());
}

TEST_F(PdoFixture, SynchronousRpdoTakesEffectAtTheNextSync) {
  map_rpdo(1);
  EXPECT_EQ(rpdo.receive(kCommand), RxPdo::Taken::kLatched);
  EXPECT_EQ(target, 0);
  EXPECT_TRUE(rpdo.sync());
  EXPECT_EQ(control, 0x000F);
  EXPECT_EQ(mode, -1);
  EXPECT_EQ(target, 0x12345678);
  EXPECT_FALSE(rpdo.sync()) << "a PDO is applied once";
}

TEST_F(PdoFixture, EventDrivenRpdoTakesEffectAtOnce) {
  map_rpdo(254);
  EXPECT_EQ(rpdo.receive(kCommand), RxPdo::Taken::kApplied);
  EXPECT_EQ(target, 0x12345678);
}

TEST_F(PdoFixture, ShortRpdoIsNotProcessed) {
  map_rpdo(254);
  EXPECT_EQ(rpdo.receive(wire(0x205, {0x0F, 0x00, 0xFF})), RxPdo::Taken::kTooShort);
  EXPECT_EQ(control, 0);
}

TEST_F(PdoFixture, TpdoIsSentEverySyncOrEveryThird) {
  map_tpdo(1);
  tpdo.sync(out.sink());
  EXPECT_EQ(out.take(), Frames{kFeedback});
  ASSERT_EQ(write8(0x1800, 2, 3), AbortCode::kNone);
  std::vector<std::size_t> sent;
  for (int i = 0; i < 6; ++i) {
    tpdo.sync(out.sink());
    sent.push_back(out.take().size());
  }
  EXPECT_EQ(sent, (std::vector<std::size_t>{0, 0, 1, 0, 0, 1}));
}

TEST_F(PdoFixture, AcyclicTpdoIsSentAtTheSyncAfterAChange) {
  map_tpdo(0);
  std::vector<std::size_t> sent;
  for (int i = 0; i < 6; ++i) {
    if (i == 3) actual = 7;
    tpdo.process(1'000'000, out.sink());
    EXPECT_TRUE(out.take().empty()) << "not without a SYNC";
    tpdo.sync(out.sink());
    sent.push_back(out.take().size());
  }
  EXPECT_EQ(sent, (std::vector<std::size_t>{1, 0, 0, 1, 0, 0})) << "when it comes into use, too";
}

TEST_F(PdoFixture, EventTpdoIsSentWhenAValueChanges) {
  for (const std::uint8_t type : {kEventManufacturer, kEventProfile}) {
    ASSERT_EQ(write32(0x1800, 1, 0xC0000185), AbortCode::kNone);
    ASSERT_EQ(write8(0x1A00, 0, 0), AbortCode::kNone);
    map_tpdo(type);
    std::vector<int> sent;
    for (int ms = 0; ms < 20; ++ms) {
      if (ms == 4) status = 0x0218;
      if (ms == 9) actual = type;
      tpdo.sync(out.sink());
      tpdo.process(1'000'000, out.sink());
      if (!out.take().empty()) sent.push_back(ms);
    }
    EXPECT_EQ(sent, (std::vector<int>{0, 4, 9})) << int{type};
    status = 0x1637;
  }
}

TEST_F(PdoFixture, EventTpdoKeepsItsInhibitTimeAndEventTimer) {
  const std::uint8_t inhibit[] = {50, 0};  // 5 ms
  const std::uint8_t timer[] = {20, 0};    // 20 ms
  ASSERT_EQ(od.write(0x1800, 3, inhibit), AbortCode::kNone);
  ASSERT_EQ(od.write(0x1800, 5, timer), AbortCode::kNone);
  map_tpdo(255);
  std::vector<int> sent;
  for (int ms = 0; ms < 40; ++ms) {
    if (ms == 2 || ms == 3) ++actual;
    tpdo.process(1'000'000, out.sink());
    if (!out.take().empty()) sent.push_back(ms);
  }
  // At once when it comes into use, 5 ms (inhibit) after that, 20 ms (event timer) after that.
  EXPECT_EQ(sent, (std::vector<int>{0, 5, 25}));
}

TEST_F(PdoFixture, CarriesSixtyFourBytesInOneFdFrame) {
  for (std::uint8_t i = 0; i < 16; ++i) {
    wide[i] = 0x01010101u * i;
    ASSERT_EQ(write32(0x1A00, static_cast<std::uint8_t>(i + 1), 0x21000020u | (i + 1u) << 8),
              AbortCode::kNone);
  }
  ASSERT_EQ(write8(0x1A00, 0, 16), AbortCode::kNone);
  ASSERT_EQ(write8(0x1800, 2, 1), AbortCode::kNone);
  ASSERT_EQ(write32(0x1800, 1, 0x185), AbortCode::kNone);
  tpdo.sync(out.sink());
  const auto frames = out.take();
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].length, 64);
  EXPECT_EQ(frames[0].flags, kFlagFd | kFlagBrs);
  for (std::size_t i = 0; i < 64; ++i) EXPECT_EQ(frames[0].data[i], i / 4);
}

TEST_F(PdoFixture, RemappingFollowsTheStandardsProcedure) {
  map_tpdo(1);
  EXPECT_EQ(write8(0x1A00, 0, 0), AbortCode::kUnsupportedAccess) << "in use";
  EXPECT_EQ(write32(0x1800, 1, 0x186), AbortCode::kRange) << "in use: another COB-ID";
  ASSERT_EQ(write32(0x1800, 1, 0x80000185), AbortCode::kNone);
  EXPECT_EQ(write32(0x1A00, 1, 0x60640020), AbortCode::kUnsupportedAccess) << "count is not 0";
  ASSERT_EQ(write8(0x1A00, 0, 0), AbortCode::kNone);
  ASSERT_EQ(write32(0x1A00, 1, 0x60640020), AbortCode::kNone);
  ASSERT_EQ(write8(0x1A00, 0, 1), AbortCode::kNone);
  ASSERT_EQ(write32(0x1800, 1, 0x00000185), AbortCode::kNone);
  tpdo.sync(out.sink());
  EXPECT_EQ(out.take(), Frames{wire(0x185, {0xFE, 0xFF, 0xFF, 0xFF})});
}

TEST_F(PdoFixture, RefusesWhatCannotBeMapped) {
  EXPECT_EQ(write32(0x1600, 1, 0x60410010), AbortCode::kNotMappable) << "an actual value";
  EXPECT_EQ(write32(0x1A00, 1, 0x60400010), AbortCode::kNotMappable) << "a demand";
  EXPECT_EQ(write32(0x1600, 1, 0x60400020), AbortCode::kNotMappable) << "wrong length";
  EXPECT_EQ(write32(0x1600, 1, 0x70000010), AbortCode::kNoObject);
  EXPECT_EQ(write32(0x1A00, 1, 0x21003020), AbortCode::kNoSubIndex);
  EXPECT_EQ(write8(0x1600, 0, 1), AbortCode::kNoObject) << "entry 1 is empty";
  EXPECT_EQ(write8(0x1600, 0, 33), AbortCode::kMappingTooLong);
  for (std::uint8_t i = 0; i < 17; ++i) {
    ASSERT_EQ(write32(0x1A00, static_cast<std::uint8_t>(i + 1), 0x21000120), AbortCode::kNone);
  }
  EXPECT_EQ(write8(0x1A00, 0, 17), AbortCode::kMappingTooLong) << "68 bytes";
}

TEST_F(PdoFixture, MapsNoMoreThanAFrameOfItsBusCarries) {
  ObjectDictionary classic{200};
  TxPdo small;
  ASSERT_TRUE(classic.add(0x2100, 1, wide[0], kReadTpdo));
  ASSERT_TRUE(small.add_to(classic, PdoDirection::kTransmit, 1, 5, kClassicFrameBytes));
  for (std::uint8_t i = 1; i <= 3; ++i) {
    ASSERT_EQ(classic.write(0x1A00, i, std::array<std::uint8_t, 4>{0x20, 1, 0, 0x21}),
              AbortCode::kNone);
  }
  EXPECT_EQ(classic.write(0x1A00, 0, std::array<std::uint8_t, 1>{3}), AbortCode::kMappingTooLong);
  EXPECT_EQ(classic.write(0x1A00, 0, std::array<std::uint8_t, 1>{2}), AbortCode::kNone);
}

TEST_F(PdoFixture, RefusesIdentifiersThatCiA301KeepsForItself) {
  for (const std::uint32_t id : {0x000u, 0x001u, 0x07Fu, 0x101u, 0x180u, 0x581u, 0x5FFu, 0x601u,
                                 0x67Fu, 0x6E0u, 0x6FFu, 0x701u, 0x77Fu, 0x780u, 0x7E4u, 0x7FFu}) {
    EXPECT_EQ(write32(0x1400, 1, id), AbortCode::kRange) << std::hex << id;
    EXPECT_EQ(write32(0x1800, 1, 0x40000000 | id), AbortCode::kRange) << std::hex << id;
  }
  for (const std::uint32_t id : {0x181u, 0x300u, 0x580u, 0x680u}) {
    EXPECT_EQ(write32(0x1400, 1, id), AbortCode::kNone) << std::hex << id;
    EXPECT_EQ(write32(0x1400, 1, 0x80000000), AbortCode::kNone) << "not in use: nobody's";
  }
}

TEST_F(PdoFixture, RefusesThePartsOfA29BitIdentifierWithoutItsBit) {
  EXPECT_EQ(write32(0x1400, 1, 0x20000205), AbortCode::kRange);
  EXPECT_EQ(write32(0x1400, 1, 0x00000A05), AbortCode::kRange) << "bit 11";
  EXPECT_EQ(write32(0x1800, 1, 0xD0000185), AbortCode::kRange) << "bit 28";
}

TEST_F(PdoFixture, RefusesReservedTransmissionTypes) {
  EXPECT_EQ(write8(0x1800, 2, 240), AbortCode::kNone);
  EXPECT_EQ(write8(0x1800, 2, 241), AbortCode::kRange);
  EXPECT_EQ(write8(0x1800, 2, 253), AbortCode::kRange);
}

TEST_F(PdoFixture, ArchiveRestoresMappingAndWhatWaits) {
  map_rpdo(1);
  ASSERT_EQ(rpdo.receive(kCommand), RxPdo::Taken::kLatched);
  Archive saved;
  rpdo.archive(saved);
  rpdo.reset();
  EXPECT_FALSE(rpdo.sync());
  Archive restore(saved.bytes());
  rpdo.archive(restore);
  ASSERT_TRUE(restore.ok() && restore.at_end());
  EXPECT_TRUE(rpdo.sync());
  EXPECT_EQ(target, 0x12345678);
}

}  // namespace
}  // namespace tandem::canopen
