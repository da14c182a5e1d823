// Markdown tables.
#pragma once

#include <array>
#include <cstdio>
#include <ostream>
#include <string>
#include <vector>

namespace simulation {

inline std::string decimals(double value, int count)
{
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.*f", count, value);
    return text.data();
}

/// Three digits that count: 1.06, 12.5, 510.
inline std::string three_digits(double value)
{
    return decimals(value, value < 10 ? 2 : value < 100 ? 1 : 0);
}

using Row = std::vector<std::string>;

inline void print_row(std::ostream& out, Row const& cells)
{
    for (std::string const& cell : cells)
        out << "| " << cell << ' ';
    out << "|\n";
}

inline void print_heading(std::ostream& out, Row const& cells)
{
    print_row(out, cells);
    out << "|---";
    for (std::size_t cell = 1; cell != cells.size(); ++cell)
        out << "|---:";
    out << "|\n";
}

} // namespace simulation
