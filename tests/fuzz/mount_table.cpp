// The kernel's list of mounts: what is found lies in the project's folder, innermost first, and nothing is
// missed, whatever a simulation has called its folders.
#include "fuzz.hpp"

#include "adapters/files/mounts.hpp"

#include <string>
#include <vector>

using namespace webots_cloud;

namespace {

constexpr std::string_view folder = "/tmp/instances/1";

bool is_below(std::string_view path, std::string_view above)
{
    return path == above || (path.starts_with(above) && path[above.size()] == '/');
}

/// As the kernel writes it.
std::string escaped(std::string_view path)
{
    std::string text;
    for (char const c : path)
        if (c == ' ')
            text += "\\040";
        else if (c == '\t')
            text += "\\011";
        else if (c == '\n')
            text += "\\012";
        else if (c == '\\')
            text += "\\134";
        else
            text += c;
    return text;
}

/// Mount points: `<where> <length> <name>`, each in a folder that may be the project's, one beside it, or the
/// last one.
std::vector<std::string> cook(std::string_view recipe)
{
    std::vector<std::string> points;
    while (!recipe.empty() && points.size() < 20) {
        auto const where = fuzz::take_byte(recipe) % 5;
        std::string name(fuzz::take(recipe, fuzz::take_byte(recipe) % 16));
        std::erase(name, '\0');
        auto const above = where == 0       ? std::string(folder)
                           : where == 1     ? std::string(folder) + "0"
                           : where == 2     ? "/tmp/instances"
                           : where == 3     ? std::string()
                           : points.empty() ? std::string("/")
                                            : points.back();
        points.push_back(name.empty() && !above.empty() ? above : above + "/" + name);
    }
    return points;
}

void check(std::vector<std::string> const& found)
{
    for (std::size_t i = 0; i < found.size(); ++i)
        fuzz::require(is_below(found[i], folder) && found[i].size() <= 4096);
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto const text = fuzz::text_of(data, std::min<std::size_t>(size, 1024)); // more says nothing new
    check(adapters::mounts_below(text, folder));

    auto const points = cook(text);
    std::string table;
    std::vector<std::string> expected;
    for (auto const& point : points) {
        table += "36 35 98:0 / " + escaped(point) + " rw,noatime master:1 - ext3 /dev/root rw\n";
        if (is_below(point, folder))
            expected.insert(expected.begin(), point);
    }
    fuzz::require(adapters::mounts_below(table, folder) == expected);
    return 0;
}
