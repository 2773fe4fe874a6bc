#include "log/import/csv_rows.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tandem::log {
namespace {

TEST(CsvRows, TimesAreReadToTheNanosecond) {
  auto rows = CsvRows::open("t\n1700000000.123456789\n-0.0000000015\n1e12\nx\n", "f", {});
  ASSERT_TRUE(rows);
  ASSERT_TRUE(rows->next());
  EXPECT_EQ(rows->time_ns(0, 1'000'000'000), 1'700'000'000'123'456'789);
  ASSERT_TRUE(rows->next());
  EXPECT_EQ(rows->time_ns(0, 1'000'000'000), -2);
  ASSERT_TRUE(rows->next());
  EXPECT_FALSE(rows->time_ns(0, 1'000'000'000)) << "beyond 292 years";
  EXPECT_EQ(rows->time_ns(0, 1), 1'000'000'000'000);
  ASSERT_TRUE(rows->next());
  EXPECT_FALSE(rows->time_ns(0, 1));
  EXPECT_FALSE(rows->next());
}

TEST(CsvRows, NumbersAreWholeCells) {
  auto rows = CsvRows::open("a,b,c,d,e,f\n+1.5, -2e-3 ,,inf,1e999,1.5m\n", "f", {});
  ASSERT_TRUE(rows);
  ASSERT_TRUE(rows->next());
  EXPECT_EQ(rows->number(0), 1.5);
  EXPECT_EQ(rows->number(1), -2e-3);
  for (const std::size_t i : {2U, 3U, 4U}) {
    ASSERT_TRUE(rows->number(i)) << i;
    EXPECT_TRUE(std::isnan(*rows->number(i))) << i;
  }
  EXPECT_FALSE(rows->number(5));
}

TEST(CsvRows, OddHeadersAreRefused) {
  EXPECT_EQ(CsvRows::open("a,,b\n", "f", {}).error().to_string().substr(0, 40),
            "f:1: column 2 of the header has no name ");
  EXPECT_EQ(CsvRows::open("a,b,a\n", "f", {}).error().message, "the header has two columns 'a'");
  EXPECT_FALSE(CsvRows::open("\n \r\n", "f", {}));
}

TEST(CsvRows, LinesAreCountedAcrossWhatIsLeftOut) {
  CsvFormat format;
  format.comment = '#';
  format.skip_lines = 2;
  auto rows = CsvRows::open("one\ntwo\n# three\n\na,\"b,c\"\n1,2\n#\n3,4", "f", format);
  ASSERT_TRUE(rows);
  EXPECT_EQ(rows->names(), (std::vector<std::string>{"a", "b,c"}));
  ASSERT_TRUE(rows->next());
  EXPECT_EQ(rows->line(), 6);
  ASSERT_TRUE(rows->next());
  EXPECT_EQ(rows->line(), 8);
  EXPECT_EQ(rows->cells()[1], "4");
  EXPECT_FALSE(rows->next());
}

}  // namespace
}  // namespace tandem::log
