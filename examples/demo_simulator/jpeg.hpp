#pragma once

#include <string>

namespace webots_cloud::demo {

/// Pixels as cairo keeps them in CAIRO_FORMAT_RGB24: 32 bits each, blue in the lowest byte.
struct Pixels
{
    unsigned char const* data = nullptr;
    int width = 0;
    int height = 0;
    int stride = 0; ///< bytes from one row to the next
};

/// The pixels as a JPEG file. Throws std::runtime_error with the library's message.
std::string jpeg_from(Pixels const& pixels, int quality = 85);

} // namespace webots_cloud::demo
