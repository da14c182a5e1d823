#pragma once

#include "geometry.hpp"

namespace webots_cloud::demo {

/// A point of the scene: metres, z upwards.
struct Point3
{
    double x = 0;
    double y = 0;
    double z = 0;
};

/// What a person can change with the mouse.
struct View
{
    double turn = -0.2; ///< radians about the vertical axis; 0 looks north
    double tilt = 0.92; ///< radians below the horizon
    double zoom = 1;    ///< 1 shows the whole arena

    void rotate(double turn_by, double tilt_by);
    void zoom_by(double factor);
};

/// A pinhole camera that looks at the middle of the arena.
class Camera
{
public:
    /// Chooses the distance at which a box of `size` and `height` fills a picture of that many pixels.
    Camera(View const& view, Point size, double height, int width_pixels, int height_pixels);

    /// Where a point appears, in pixels from the top left corner.
    Point project(Point3 const& point) const;

    /// Distance from the camera along its line of sight, metres.
    double depth(Point3 const& point) const;

    /// Pixels per metre at a point.
    double scale(Point3 const& point) const { return focal_ / depth(point); }

    Point3 const& position() const { return position_; }

private:
    /// What a box covers, in pixels, and its smallest distance.
    struct Extent
    {
        double left = 1e9;
        double right = -1e9;
        double top = 1e9;
        double bottom = -1e9;
        double nearest = 1e9;
    };

    void look_from(double distance);
    Extent outline_of(Point size, double height) const;
    bool fits(Extent const& extent) const;

    View view_;
    double width_;
    double height_;
    double focal_;
    Point3 position_;
    Point3 right_;
    Point3 up_;
    Point3 forward_;
    double shift_ = 0; ///< pixels downwards: puts the arena in the middle of the picture
};

} // namespace webots_cloud::demo
