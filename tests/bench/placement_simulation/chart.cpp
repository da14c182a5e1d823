#include "chart.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace simulation {

namespace {

constexpr double width = 760;
constexpr double height = 400;
constexpr double left = 64;
constexpr double right = 16;
constexpr double above = 66;
constexpr double below = 52;
// Told apart by everybody (Okabe and Ito 2008).
constexpr std::array<char const*, 6> colours = {"#0072b2", "#d55e00", "#009e73",
                                                "#cc79a7", "#e69f00", "#555555"};

std::string number(double value)
{
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.4g", value);
    return text.data();
}

std::string place(double value)
{
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.1f", value);
    return text.data();
}

std::string text(double x, double y, std::string const& words, std::string const& more = "")
{
    return "<text x=\"" + place(x) + "\" y=\"" + place(y) + "\"" + more + ">" + words + "</text>\n";
}

std::string line(double x1, double y1, double x2, double y2, std::string const& style)
{
    return "<line x1=\"" + place(x1) + "\" y1=\"" + place(y1) + "\" x2=\"" + place(x2) + "\" y2=\"" +
           place(y2) + "\" " + style + "/>\n";
}

class Drawing
{
public:
    explicit Drawing(Chart const& chart) : chart_(chart), top_(chart.top > 0 ? chart.top : greatest())
    {
        if (chart.logarithmic)
            top_ = std::pow(10, std::ceil(std::log10(top_)));
    }

    std::string svg() const
    {
        return "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 760 400\" font-family=\"sans-serif\" "
               "font-size=\"12\">\n<rect width=\"760\" height=\"400\" fill=\"white\"/>\n" +
               text(width / 2, 20, chart_.title, " text-anchor=\"middle\" font-size=\"15\"") + legend() +
               axes() + (chart_.bars ? bars() : lines()) + limit() + "</svg>\n";
    }

private:
    double greatest() const
    {
        double most = chart_.limit.value_or(1);
        for (Series const& series : chart_.series)
            most = std::max(most, *std::ranges::max_element(series.values));
        return most * 1.08;
    }

    double y(double value) const
    {
        double const share =
            chart_.logarithmic ? std::log10(std::max(value, 1.0)) / std::log10(top_) : value / top_;
        return height - below - std::min(share, 1.0) * (height - above - below);
    }
    double slot() const { return (width - left - right) / static_cast<double>(chart_.categories.size()); }
    double middle(std::size_t category) const
    {
        return left + slot() * (static_cast<double>(category) + 0.5);
    }
    static std::string colour(std::size_t series) { return colours[series % colours.size()]; }

    std::string legend() const
    {
        std::string out;
        double x = left;
        for (std::size_t series = 0; series != chart_.series.size(); ++series) {
            std::string const& name = chart_.series[series].name;
            out += "<rect x=\"" + place(x) + "\" y=\"36\" width=\"12\" height=\"12\" fill=\"" +
                   colour(series) + "\"/>\n";
            out += text(x + 17, 46, name);
            x += 34 + 6.6 * static_cast<double>(name.size());
        }
        return out;
    }

    std::string axes() const
    {
        std::string out = line(left, height - below, width - right, height - below, "stroke=\"black\"");
        for (double const tick : ticks()) {
            out += line(left, y(tick), width - right, y(tick), "stroke=\"#dddddd\"");
            out += text(left - 6, y(tick) + 4, number(tick), " text-anchor=\"end\"");
        }
        for (std::size_t category = 0; category != chart_.categories.size(); ++category)
            out += text(middle(category), height - below + 16, chart_.categories[category],
                        " text-anchor=\"middle\"");
        out += text((left + width - right) / 2, height - 12, chart_.x_label, " text-anchor=\"middle\"");
        std::string const y_middle = place((above + height - below) / 2);
        return out + text(0, 0, chart_.y_label,
                          " text-anchor=\"middle\" transform=\"translate(16," + y_middle + ") rotate(-90)\"");
    }

    std::vector<double> ticks() const
    {
        std::vector<double> ticks;
        if (chart_.logarithmic) {
            for (double tick = 1; tick <= top_; tick *= 10)
                ticks.push_back(tick);
            return ticks;
        }
        double const rough = top_ / 6;
        double const power = std::pow(10, std::floor(std::log10(rough)));
        double const step = power * (rough / power < 2 ? 2 : rough / power < 5 ? 5 : 10);
        for (double tick = 0; tick <= top_; tick += step)
            ticks.push_back(tick);
        return ticks;
    }

    std::string bars() const
    {
        std::string out;
        auto const count = static_cast<double>(chart_.series.size());
        double const thick = 0.8 * slot() / count;
        for (std::size_t series = 0; series != chart_.series.size(); ++series)
            for (std::size_t category = 0; category != chart_.categories.size(); ++category) {
                double const value = chart_.series[series].values[category];
                double const x = middle(category) + (static_cast<double>(series) - count / 2) * thick;
                out += "<rect x=\"" + place(x) + "\" y=\"" + place(y(value)) + "\" width=\"" +
                       place(thick - 1) + "\" height=\"" + place(height - below - y(value)) + "\" fill=\"" +
                       colour(series) + "\"/>\n";
            }
        return out;
    }

    std::string lines() const
    {
        std::string out;
        for (std::size_t series = 0; series != chart_.series.size(); ++series) {
            std::string points;
            std::string dots;
            for (std::size_t category = 0; category != chart_.categories.size(); ++category) {
                std::string const at_x = place(middle(category));
                std::string const at_y = place(y(chart_.series[series].values[category]));
                points += at_x + "," + at_y + " ";
                dots += "<circle cx=\"" + at_x + "\" cy=\"" + at_y + "\" r=\"3.5\" fill=\"" + colour(series) +
                        "\"/>\n";
            }
            out += "<polyline points=\"" + points + "\" fill=\"none\" stroke-width=\"2\" stroke=\"" +
                   colour(series) + "\"/>\n" + dots;
        }
        return out;
    }

    std::string limit() const
    {
        if (!chart_.limit)
            return {};
        return line(left, y(*chart_.limit), width - right, y(*chart_.limit),
                    "stroke=\"black\" stroke-dasharray=\"6 4\"") +
               text(width - right - 4, y(*chart_.limit) - 5, chart_.limit_name, " text-anchor=\"end\"");
    }

    Chart const& chart_;
    double top_;
};

} // namespace

std::string to_svg(Chart const& chart)
{
    return Drawing(chart).svg();
}

} // namespace simulation
