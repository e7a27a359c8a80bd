// The one place where toml++ is compiled; everywhere else TOML_HEADER_ONLY is 0.
#define TOML_IMPLEMENTATION
#include <toml++/toml.h>
