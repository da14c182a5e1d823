// The servers of the folder where we run: starts them, stops them, says which of them run.
#pragma once

#include <string_view>
#include <vector>

namespace webots_cloud::site {

/// What webots-site does. `arguments`: without the program's name. Returns its exit status.
int run(std::vector<std::string_view> const& arguments);

} // namespace webots_cloud::site
