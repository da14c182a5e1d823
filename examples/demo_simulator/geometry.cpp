#include "geometry.hpp"

#include <algorithm>

namespace webots_cloud::demo {
namespace {

/// Part of a ray, as distances along it.
struct Span
{
    double enter = -none;
    double leave = none;
};

/// Cuts `span` to where one coordinate, `from + t * step`, lies within [-half, half].
void clip(Span& span, double from, double step, double half)
{
    if (std::abs(step) < 1e-12) {
        if (std::abs(from) > half)
            span.leave = -none;
        return;
    }
    double const a = (-half - from) / step;
    double const b = (half - from) / step;
    span.enter = std::max(span.enter, std::min(a, b));
    span.leave = std::min(span.leave, std::max(a, b));
}

double tile_size(Point half)
{
    double const longest = 2 * std::max(half.x, half.y);
    return longest <= 4 ? 0.2 : longest <= 12 ? 0.5 : longest <= 40 ? 2 : 5;
}

} // namespace

std::vector<Rectangle> dark_tiles(Point half)
{
    std::vector<Rectangle> tiles;
    double const step = tile_size(half);
    int const columns = static_cast<int>(std::ceil(half.x / step));
    int const rows = static_cast<int>(std::ceil(half.y / step));
    for (int i = -columns; i < columns; ++i) {
        for (int j = -rows; j < rows; ++j) {
            if ((i + j) % 2 != 0)
                continue;
            Point const low{std::max(i * step, -half.x), std::max(j * step, -half.y)};
            Point const high{std::min((i + 1) * step, half.x), std::min((j + 1) * step, half.y)};
            tiles.push_back({{0.5 * (low + high), 0}, 0.5 * (high - low)});
        }
    }
    return tiles;
}

double distance_to_circle(Ray const& ray, Point centre, double radius)
{
    Point const offset = centre - ray.origin;
    double const along = dot(offset, ray.direction);
    double const discriminant = radius * radius - (dot(offset, offset) - along * along);
    if (discriminant < 0 || along < 0)
        return none;
    return std::max(0.0, along - std::sqrt(discriminant));
}

double distance_to_rectangle(Ray const& ray, Rectangle const& rectangle)
{
    Point const origin = rectangle.to_local(ray.origin);
    Point const direction = rotated(ray.direction, -rectangle.pose.heading);
    Span span;
    clip(span, origin.x, direction.x, rectangle.half.x);
    clip(span, origin.y, direction.y, rectangle.half.y);
    return span.leave < span.enter || span.leave < 0 ? none : std::max(0.0, span.enter);
}

double distance_to_room(Ray const& ray, Point half)
{
    Span span;
    clip(span, ray.origin.x, ray.direction.x, half.x);
    clip(span, ray.origin.y, ray.direction.y, half.y);
    return std::max(0.0, span.leave);
}

Point push_out_of_rectangle(Point centre, double radius, Rectangle const& rectangle)
{
    Point const local = rectangle.to_local(centre);
    Point const half = rectangle.half;
    Point const nearest{std::clamp(local.x, -half.x, half.x), std::clamp(local.y, -half.y, half.y)};
    Point const away = local - nearest;
    double const distance = length(away);
    if (distance >= radius)
        return {};
    if (distance > 1e-9)
        return rotated((radius - distance) / distance * away, rectangle.pose.heading);
    // The centre is inside: leave through the nearest side.
    double const out_x = half.x - std::abs(local.x) + radius;
    double const out_y = half.y - std::abs(local.y) + radius;
    Point const out =
        out_x < out_y ? Point{std::copysign(out_x, local.x), 0} : Point{0, std::copysign(out_y, local.y)};
    return rotated(out, rectangle.pose.heading);
}

} // namespace webots_cloud::demo
