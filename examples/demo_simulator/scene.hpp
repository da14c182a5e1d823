#pragma once

#include "arena.hpp"

#include <string>

/// The texts of the x3d and w3d modes.
namespace webots_cloud::demo {

/// The XML document that follows `model:`. Every node has an id "n<number>".
std::string scene_xml(Arena const& arena);

/// `application/json:{"time":..,"updates":[..]}` with the pose of every robot and its wheels; the array is
/// named "poses" for worlds of R2022b and older.
std::string update_json(Arena const& arena);

} // namespace webots_cloud::demo
