#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace pliant {

// Values of JSON that other programs wrote: whatever a value is, asking for it throws nothing.

/// The value behind a JSON pointer, such as "/disposition/attached_pic"; null where there is none.
const nlohmann::json& value_at(const nlohmann::json& json, const char* pointer);

/// A text; "" where there is none.
std::string text_at(const nlohmann::json& json, const char* pointer);

/// A whole number; `otherwise` where there is none that fits.
int whole_number_at(const nlohmann::json& json, const char* pointer, int otherwise);

}  // namespace pliant
