// The names of robots in 3D scenes: signs that show a picture of the name, which the file server draws.
#pragma once

#include "world_file.hpp"

#include <string>

namespace webots_cloud::demo {

/// Where the file server has the picture. It is another one for another name or colour, since browsers keep
/// pictures.
std::string sign_path(RobotDescription const& robot);

/// How many times as wide as high.
double sign_proportion(RobotDescription const& robot);

/// A PNG with a transparent ground.
std::string sign_picture(RobotDescription const& robot);

} // namespace webots_cloud::demo
