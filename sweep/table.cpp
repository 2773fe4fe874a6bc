#include "sweep/table.hpp"

#include <fmt/core.h>
#include <sqlite3.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>

#include "apps/text/draft.hpp"
#include "base/open_file.hpp"

namespace tandem::sweep {
namespace {

constexpr std::size_t kBlock = std::size_t{1} << 20;

/// A varied value: a number where it is one, else the text in its quotes.
Cell cell_of(const std::string& toml) {
  double number = 0.0;
  const char* const end = toml.data() + toml.size();
  const auto read = std::from_chars(toml.data(), end, number);
  if (read.ec == std::errc() && read.ptr == end) return number;
  if (toml.size() >= 2 && toml.front() == '"') return toml.substr(1, toml.size() - 2);
  return toml;
}

Cell number_or_none(const std::optional<double>& value) { return value ? Cell(*value) : Cell(); }

std::string csv_text(const Cell& cell) {
  if (const auto* whole = std::get_if<std::int64_t>(&cell)) return std::to_string(*whole);
  if (const auto* number = std::get_if<double>(&cell)) return fmt::format("{}", *number);
  const auto* text = std::get_if<std::string>(&cell);
  if (text == nullptr) return {};
  if (text->find_first_of(",\"\r\n") == std::string::npos) return *text;
  std::string quoted = "\"";
  for (const char letter : *text) quoted += letter == '"' ? "\"\"" : std::string(1, letter);
  return quoted + '"';
}

Error table_error(const std::string& file, const std::string& why) {
  return {.message = "cannot be written: " + why,
          .hint = "make room; then the same command writes it",
          .file = file,
          .key = {}};
}

using Row = std::function<void(const Point&, const PointResult&)>;

/// Every point that is there, in the order of the study.
void visit(const Points& points, const std::vector<std::optional<PointResult>>& results,
           const Row& row) {
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (results[i]) row(points.at(i), *results[i]);
  }
}

Status write_csv(const std::string& path, const std::vector<Column>& columns, const Points& points,
                 const std::vector<std::optional<PointResult>>& results) {
  apps::Draft draft = apps::Draft::file(path);
  const auto file = open_output(draft.path());
  if (!file) return std::unexpected(table_error(path, file.error().message));
  std::string text;
  int error = 0;
  const auto end_line = [&] {
    text.back() = '\n';
    if (text.size() < kBlock || error != 0) return;
    error = write_all(*file, text);
    text.clear();
  };
  for (const Column& column : columns) text += csv_text(column.name) + ",";
  end_line();
  visit(points, results, [&](const Point& point, const PointResult& result) {
    for (const Column& column : columns) text += csv_text(column.of(point, result)) + ",";
    end_line();
  });
  if (error == 0) error = write_all(*file, text);
  if (error != 0) return std::unexpected(table_error(path, std::strerror(error)));
  return draft.place();
}

std::string sql_name(const std::string& name) {
  std::string quoted = "\"";
  for (const char letter : name) quoted += letter == '"' ? "\"\"" : std::string(1, letter);
  return quoted + '"';
}

/// A database that is written once.
class Database {
 public:
  explicit Database(const std::string& path) {
    ok_ = sqlite3_open(path.c_str(), &db_) == SQLITE_OK;
    // It is a draft: what is cut is written again. The page size is part of the bytes.
    run("PRAGMA page_size = 4096; PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; BEGIN");
  }
  ~Database() { sqlite3_close(db_); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  void run(const std::string& sql) {
    ok_ = ok_ && sqlite3_exec(db_, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK;
  }
  /// Fills a table row by row.
  class Insert {
   public:
    Insert(Database& database, const std::string& table, std::size_t columns)
        : database_(database) {
      std::string sql = "INSERT INTO " + table + " VALUES (";
      for (std::size_t i = 0; i < columns; ++i) sql += i == 0 ? "?" : ",?";
      database.ok_ = database.ok_ && sqlite3_prepare_v2(database.db_, (sql + ")").c_str(), -1,
                                                        &statement_, nullptr) == SQLITE_OK;
    }
    ~Insert() { sqlite3_finalize(statement_); }
    Insert(const Insert&) = delete;
    Insert& operator=(const Insert&) = delete;
    void row(const std::vector<Cell>& cells) {
      if (!database_.ok_) return;
      int at = 0;
      for (const Cell& cell : cells) bind(++at, cell);
      database_.ok_ = sqlite3_step(statement_) == SQLITE_DONE;
      sqlite3_reset(statement_);
    }

   private:
    void bind(int at, const Cell& cell) {
      if (const auto* whole = std::get_if<std::int64_t>(&cell)) {
        sqlite3_bind_int64(statement_, at, *whole);
      } else if (const auto* number = std::get_if<double>(&cell)) {
        sqlite3_bind_double(statement_, at, *number);
      } else if (const auto* text = std::get_if<std::string>(&cell)) {
        sqlite3_bind_text(statement_, at, text->data(), static_cast<int>(text->size()),
                          SQLITE_TRANSIENT);
      } else {
        sqlite3_bind_null(statement_, at);
      }
    }
    Database& database_;
    sqlite3_stmt* statement_ = nullptr;
  };
  [[nodiscard]] std::string trouble() {
    run("COMMIT");
    return ok_ ? "" : sqlite3_errmsg(db_);
  }

 private:
  sqlite3* db_ = nullptr;
  bool ok_ = false;
};

Status write_database(const std::string& path, const std::vector<Column>& columns,
                      const Points& points,
                      const std::vector<std::optional<PointResult>>& results) {
  apps::Draft draft = apps::Draft::file(path);
  std::string why;
  {
    Database database(draft.path());
    std::string names;
    for (const Column& column : columns)
      names += (names.empty() ? "" : ", ") + sql_name(column.name);
    database.run("CREATE TABLE points (" + names + ")");
    database.run(
        "CREATE TABLE expectations (point, seed, variant, name, passed, margin, unit, at_s, "
        "reason)");
    {
      Database::Insert into(database, "points", columns.size());
      Database::Insert expectation(database, "expectations", 9);
      visit(points, results, [&](const Point& point, const PointResult& result) {
        std::vector<Cell> cells;
        for (const Column& column : columns) cells.push_back(column.of(point, result));
        into.row(cells);
        for (const runtime::ExpectationResult& one : result.expectations) {
          expectation.row(
              {point.name, point.seed ? Cell(static_cast<std::int64_t>(*point.seed)) : Cell(),
               static_cast<std::int64_t>(point.variant), one.name, std::int64_t{one.passed},
               number_or_none(one.margin), one.unit, number_or_none(one.at_s), one.reason});
        }
      });
    }
    why = database.trouble();
  }
  if (!why.empty()) return std::unexpected(table_error(path, why));
  return draft.place();
}

}  // namespace

const runtime::ExpectationResult* expectation_in(const PointResult& result,
                                                 const std::string& name) {
  const auto it = std::ranges::find(result.expectations, name, &runtime::ExpectationResult::name);
  return it == result.expectations.end() ? nullptr : &*it;
}

std::vector<NamedMargin> margins_of(const std::vector<std::optional<PointResult>>& results) {
  std::vector<NamedMargin> all;
  for (const auto& result : results) {
    if (!result) continue;
    for (const runtime::ExpectationResult& one : result->expectations) {
      if (one.margin && std::ranges::find(all, one.name, &NamedMargin::name) == all.end())
        all.push_back({one.name, one.unit});
    }
  }
  return all;
}

std::vector<Column> columns_of(const Study& study,
                               const std::vector<std::optional<PointResult>>& results) {
  std::vector<Column> columns;
  columns.push_back({"point", [](const Point& p, const PointResult&) { return Cell(p.name); }});
  if (!study.variants.empty()) {
    columns.push_back({"variant", [&study](const Point& p, const PointResult&) {
                         return Cell(study.variants[p.variant].name);
                       }});
  }
  for (std::size_t k = 0; k < study.vary.size(); ++k) {
    columns.push_back({study.vary[k].key,
                       [k](const Point& p, const PointResult&) { return cell_of(p.values[k]); }});
  }
  columns.push_back({"seed", [](const Point& p, const PointResult&) {
                       return p.seed ? Cell(static_cast<std::int64_t>(*p.seed)) : Cell();
                     }});
  columns.push_back(
      {"passed", [](const Point&, const PointResult& r) { return Cell(std::int64_t{r.passed}); }});
  columns.push_back({"ended", [](const Point&, const PointResult& r) { return Cell(r.ended); }});
  columns.push_back({"why", [](const Point&, const PointResult& r) { return Cell(r.why()); }});
  for (const NamedMargin& margin : margins_of(results)) {
    columns.push_back({fmt::format("margin: {}{}", margin.name,
                                   margin.unit.empty() ? "" : " [" + margin.unit + "]"),
                       [name = margin.name](const Point&, const PointResult& r) {
                         const auto* one = expectation_in(r, name);
                         return one == nullptr ? Cell() : number_or_none(one->margin);
                       }});
  }
  return columns;
}

Status write_tables(const std::string& folder, const Study& study, const Points& points,
                    const std::vector<std::optional<PointResult>>& results) {
  const std::vector<Column> columns = columns_of(study, results);
  if (const Status s = write_csv(folder + "/results.csv", columns, points, results); !s) return s;
  if (const Status s = write_database(folder + "/results.sqlite", columns, points, results); !s)
    return s;
  const std::vector<Column> times{
      columns.front(),
      {"seconds", [](const Point&, const PointResult& r) { return Cell(r.seconds); }}};
  return write_csv(folder + "/times.csv", times, points, results);
}

}  // namespace tandem::sweep
