#include "camera.hpp"

#include <algorithm>
#include <initializer_list>

namespace webots_cloud::demo {
namespace {

double dot3(Point3 const& a, Point3 const& b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
Point3 minus(Point3 const& a, Point3 const& b)
{
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}

} // namespace

void View::rotate(double turn_by, double tilt_by)
{
    turn = std::remainder(turn + turn_by, 6.283185307179586);
    tilt = std::clamp(tilt + tilt_by, 0.25, 1.5);
}

void View::zoom_by(double factor)
{
    zoom = std::clamp(zoom * factor, 0.4, 4.0);
}

Camera::Camera(View const& view, Point size, double height, int width_pixels, int height_pixels)
    : view_(view), width_(width_pixels), height_(height_pixels),
      focal_(1.6 * std::min(width_pixels, height_pixels))
{
    double near = 0.1;
    double far = 100 * length(size) + 100 * height;
    for (int i = 0; i < 40; ++i) {
        double const middle = (near + far) / 2;
        look_from(middle);
        (fits(outline_of(size, height)) ? far : near) = middle;
    }
    look_from(far);
    Extent const seen = outline_of(size, height);
    // The title line takes a little more room than the caption at the bottom.
    shift_ = 0.52 * height_ - (seen.top + seen.bottom) / 2;
    look_from(far / view_.zoom);
}

void Camera::look_from(double distance)
{
    double const st = std::sin(view_.turn);
    double const ct = std::cos(view_.turn);
    double const down = std::sin(view_.tilt);
    double const level = std::cos(view_.tilt);
    forward_ = {-st * level, ct * level, -down};
    right_ = {ct, st, 0};
    up_ = {-st * down, ct * down, level};
    position_ = {-distance * forward_.x, -distance * forward_.y, -distance * forward_.z};
}

Camera::Extent Camera::outline_of(Point size, double height) const
{
    Extent extent;
    for (double const x : {-size.x / 2, size.x / 2}) {
        for (double const y : {-size.y / 2, size.y / 2}) {
            for (double const z : {0.0, height}) {
                Point const p = project({x, y, z});
                extent.left = std::min(extent.left, p.x);
                extent.right = std::max(extent.right, p.x);
                extent.top = std::min(extent.top, p.y);
                extent.bottom = std::max(extent.bottom, p.y);
                extent.nearest = std::min(extent.nearest, depth({x, y, z}));
            }
        }
    }
    return extent;
}

bool Camera::fits(Extent const& extent) const
{
    return extent.nearest > 0.1 && extent.left > 0.03 * width_ && extent.right < 0.97 * width_ &&
           extent.bottom - extent.top < 0.82 * height_;
}

double Camera::depth(Point3 const& point) const
{
    return std::max(0.02, dot3(minus(point, position_), forward_));
}

Point Camera::project(Point3 const& point) const
{
    Point3 const offset = minus(point, position_);
    double const k = focal_ / depth(point);
    return {width_ / 2 + k * dot3(offset, right_), height_ / 2 + shift_ - k * dot3(offset, up_)};
}

} // namespace webots_cloud::demo
