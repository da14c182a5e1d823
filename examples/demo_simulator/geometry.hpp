#pragma once

#include <cmath>
#include <vector>

/// Plane geometry of the arena: metres and radians, x to the east, y to the north, angles anticlockwise.
namespace webots_cloud::demo {

struct Point
{
    double x = 0;
    double y = 0;

    friend Point operator+(Point a, Point b) { return {a.x + b.x, a.y + b.y}; }
    friend Point operator-(Point a, Point b) { return {a.x - b.x, a.y - b.y}; }
    friend Point operator*(double k, Point a) { return {k * a.x, k * a.y}; }
};

struct Pose
{
    Point position;
    double heading = 0; ///< 0 looks along x
};

inline double dot(Point a, Point b)
{
    return a.x * b.x + a.y * b.y;
}
inline double length(Point a)
{
    return std::hypot(a.x, a.y);
}
inline Point unit(double angle)
{
    return {std::cos(angle), std::sin(angle)};
}
inline Point rotated(Point a, double angle)
{
    double const c = std::cos(angle);
    double const s = std::sin(angle);
    return {c * a.x - s * a.y, s * a.x + c * a.y};
}

struct Ray
{
    Point origin;
    Point direction; ///< unit length
};

/// A rectangle turned by the pose's heading; `half` holds half its side lengths.
struct Rectangle
{
    Pose pose;
    Point half;

    Point to_local(Point p) const { return rotated(p - pose.position, -pose.heading); }
    Point to_world(Point p) const { return pose.position + rotated(p, pose.heading); }
};

/// The dark ones of the tiles on the floor of the axis-parallel room [-half, half]; those at its walls are
/// cut off.
std::vector<Rectangle> dark_tiles(Point half);

// Distance along the ray to the first point of the shape, or `none` when the ray misses it.
inline constexpr double none = 1e9;
double distance_to_circle(Ray const& ray, Point centre, double radius);
double distance_to_rectangle(Ray const& ray, Rectangle const& rectangle);
/// The ray starts inside the axis-parallel room [-half, half] and meets its wall from inside.
double distance_to_room(Ray const& ray, Point half);

/// How far a circle must be moved to stop overlapping the rectangle; {0, 0} when it does not overlap.
Point push_out_of_rectangle(Point centre, double radius, Rectangle const& rectangle);

} // namespace webots_cloud::demo
