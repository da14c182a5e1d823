// Charts as SVG text: the same figures give the same file.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace simulation {

struct Series
{
    std::string name;
    std::vector<double> values; ///< One per category.
};

struct Chart
{
    std::string title;
    std::string x_label;
    std::string y_label;
    std::vector<std::string> categories;
    std::vector<Series> series;
    bool bars = true;            ///< Groups of bars; otherwise lines over equidistant categories.
    bool logarithmic = false;    ///< Powers of ten on the y axis, from 1.
    double top = 0;              ///< Of the y axis; 0: just above the greatest value.
    std::optional<double> limit; ///< A dashed line across.
    std::string limit_name;
};

std::string to_svg(Chart const& chart);

} // namespace simulation
