#include "base/csv.hpp"

#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::csv_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Reads a file with the columns name, count and length.
struct Reading {
  explicit Reading(const std::string& content) {
    const TemporaryFolder folder;
    std::vector<Problem> problems;
    read_csv(folder.write("a.csv", content), "name,count,length", problems, [&](CsvRow& row) {
      const auto name = row.text(0);
      const auto count = row.index(1);
      const auto length = row.number(2);
      if (name && count && length)
        rows.push_back(*name + "|" + std::to_string(*count) + "|" + std::to_string(*length) + "|" +
                       std::to_string(row.line()));
    });
    for (Problem& problem : problems) {
      problem.place.file = problem.place.file.filename();
      said.push_back(to_string(problem));
    }
  }
  std::vector<std::string> rows, said;
};

TEST(Csv, IsReadRowByRow) {
  const Reading read("name,count,length\na b,3,-2.5e-1\n7,0,1\n");
  EXPECT_THAT(read.rows, ElementsAre("a b|3|-0.250000|2", "7|0|1.000000|3"));
  EXPECT_THAT(read.said, IsEmpty());
}

TEST(Csv, TakesSpacesEmptyLinesWindowsLinesAndAByteOrderMark) {
  const Reading read("\xEF\xBB\xBFname, count ,length\r\n\r\n a ,\t1, 2 \r\n\n");
  EXPECT_THAT(read.rows, ElementsAre("a|1|2.000000|3"));
  EXPECT_THAT(read.said, IsEmpty());
}

TEST(Csv, NamesLineAndColumnOfEveryFault) {
  const Reading read("name,count,length\na,1.5,x\n\"b\",-1, inf\n,1,2\nc,1\nd,1,2\n");
  EXPECT_THAT(read.rows, ElementsAre("d|1|2.000000|6"));
  EXPECT_THAT(read.said, ElementsAre(HasSubstr("a.csv:2:3: \"1.5\"; expected a whole number from 0"),
                                     HasSubstr("a.csv:2:7: \"x\"; expected a finite number"),
                                     HasSubstr("a.csv:3:1: \"\"b\"\"; expected a name without commas and quotes"),
                                     HasSubstr("a.csv:3:5: \"-1\""), HasSubstr("a.csv:3:9: \"inf\""),
                                     HasSubstr("a.csv:4:1: an empty cell"),
                                     HasSubstr("a.csv:5:1: 2 cells; expected 3 cells: name,count,length")));
}

TEST(Csv, RefusesAnotherHeaderAndEmptyFiles) {
  EXPECT_THAT(Reading("name,length\na,1\n").said,
              ElementsAre(HasSubstr("a.csv:1:1: the header \"name,length\"; expected \"name,count,length\"")));
  EXPECT_THAT(Reading("name;count;length\n").said, ElementsAre(HasSubstr("the header")));
  EXPECT_THAT(Reading("").said,
              ElementsAre(HasSubstr("a.csv: the file is empty; expected the header \"name,count,length\" and rows")));
  EXPECT_THAT(Reading("name,count,length\n\n").said, ElementsAre(HasSubstr("no row below the header")));
}

TEST(Csv, TakesColumnsThatItsReaderChooses) {
  const TemporaryFolder folder;
  const auto path = folder.write("b.csv", "what, \"how, much\" ,n\n\"a, \"\"b\"\"\",2,3\n");
  std::vector<std::string> names, cells;
  std::vector<Problem> problems;
  const auto header = [&](const std::vector<std::string>& there) {
    names = there;
    return true;
  };
  read_csv(path, header, problems, [&](CsvRow& row) { cells = {row.raw(0), row.raw(1), row.raw(2)}; });
  EXPECT_THAT(names, ElementsAre("what", "\"how, much\"", "n"));
  EXPECT_THAT(cells, ElementsAre("\"a, \"\"b\"\"\"", "2", "3"));
  read_csv(
      path, [](const auto&) { return false; }, problems, [&](CsvRow&) { FAIL() << "it was refused"; });
}

TEST(Csv, CellsWithCommasAreQuoted) {
  EXPECT_EQ(csv_cell("plain text"), "plain text");
  EXPECT_EQ(csv_cell("a, \"b\""), "\"a, \"\"b\"\"\"");
}

TEST(Csv, ThrowsWhereThereIsNoFile) {
  std::vector<Problem> problems;
  EXPECT_THAT(complaint_of([&] { read_csv("nowhere/a.csv", "x", problems, [](CsvRow&) {}); }),
              HasSubstr("cannot be read"));
}

}  // namespace
}  // namespace pliant::csv_test
