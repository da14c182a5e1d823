#include "name_sign.hpp"

#include "canvas.hpp"
#include "text.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

namespace webots_cloud::demo {
namespace {

constexpr int sign_pixels = 64; // high
constexpr double sign_font = 44;
constexpr double sign_baseline = 46;
constexpr double sign_margin = 8;

struct SignSize
{
    int width = 0;
    int height = sign_pixels;
};

SignSize sign_size(RobotDescription const& robot)
{
    Surface const nowhere(cairo_image_surface_create(CAIRO_FORMAT_A8, 1, 1));
    std::unique_ptr<cairo_t, ContextDeleter> const context(cairo_create(nowhere.get()));
    constexpr int most = 2048; // of a texture that every browser takes
    auto const width = std::ceil(text_width(context.get(), robot.name, sign_font) + 2 * sign_margin);
    return {static_cast<int>(std::min<double>(width, most))};
}

cairo_status_t append(void* text, unsigned char const* bytes, unsigned size)
{
    static_cast<std::string*>(text)->append(reinterpret_cast<char const*>(bytes), size);
    return CAIRO_STATUS_SUCCESS;
}

} // namespace

std::string sign_path(RobotDescription const& robot)
{
    auto const& [red, green, blue] = robot.colour;
    auto const what =
        robot.name + ' ' + number_text(red) + ' ' + number_text(green) + ' ' + number_text(blue);
    return "names/" + std::to_string(std::hash<std::string>{}(what)) + ".png";
}

double sign_proportion(RobotDescription const& robot)
{
    auto const [width, height] = sign_size(robot);
    return static_cast<double>(width) / height;
}

std::string sign_picture(RobotDescription const& robot)
{
    auto const [width, height] = sign_size(robot);
    Surface const surface(cairo_image_surface_create(CAIRO_FORMAT_ARGB32, width, height));
    std::unique_ptr<cairo_t, ContextDeleter> const context(cairo_create(surface.get()));
    draw_text(context.get(), {0.5 * width, sign_baseline}, robot.name, sign_font, Anchor::middle,
              shaded(robot.colour, 0.75), {1, 1, 1});
    std::string png;
    if (cairo_surface_write_to_png_stream(surface.get(), &append, &png) != CAIRO_STATUS_SUCCESS)
        throw std::runtime_error("cannot draw the name of a robot: out of memory");
    return png;
}

} // namespace webots_cloud::demo
