#pragma once

#include <string>
#include <vector>

#include "report/report.hpp"

// Parts of pages, as HTML in the style of `page_style`. Texts are HTML themselves unless it says otherwise.

namespace pliant {

/// All up to the page's content; what follows it is "</main></body></html>".
std::string page_head(const std::string& title);
/// A heading and what stands below it; nothing where there is nothing.
std::string section(const std::string& title, const std::string& body);
/// A frame, for a plot.
std::string panel(const std::string& content);
/// @param head, body  cells of the head's row; rows
std::string table(const std::string& head, const std::string& body);
/// Pictures side by side, each with its caption below.
std::string figures(const std::vector<ReportPicture>& pictures);
/// Fields over an object: colour scale, pictures, and the course over all states.
std::string fields_section(const std::vector<ReportField>& fields);
/// A cell of a table with a correlation, -1..1, and its colour.
std::string correlation_cell(double value);

}  // namespace pliant
