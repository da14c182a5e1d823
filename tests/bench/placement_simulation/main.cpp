// placement_simulation [--images FOLDER] [--seeds N] [theory] [stale] [classroom] [campus] [warm] [days]
// [fleet]: without names, all but the last two. `--seeds`: how many days of campus, warm and days are
// simulated, 20 unless told. `days` prints the figures of each day where heavy worlds wait, so that two
// versions can be compared day by day; 200 of them take half an hour, as fleet does.
#include "experiments.hpp"

#include <charconv>
#include <iostream>
#include <map>
#include <string>
#include <vector>

namespace {

bool read_count(std::string const& text, std::uint64_t& count)
{
    auto const [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
    return error == std::errc() && end == text.data() + text.size() && count != 0;
}

} // namespace

int main(int argc, char** argv)
{
    using namespace simulation;
    std::map<std::string, void (*)(Output&)> const experiments = {
        {"theory", theory},    {"stale", stale_reports}, {"classroom", classroom}, {"campus", campus},
        {"warm", warm_starts}, {"days", days},           {"fleet", fleet}};
    Output output{std::cout, {}};
    std::vector<std::string> chosen;
    for (int argument = 1; argument < argc; ++argument) {
        std::string const word = argv[argument];
        if (word == "--images" && argument + 1 < argc) {
            output.images = argv[++argument];
        } else if (word == "--seeds" && argument + 1 < argc && read_count(argv[argument + 1], output.seeds)) {
            ++argument;
        } else if (experiments.contains(word)) {
            chosen.push_back(word);
        } else {
            std::cerr
                << "usage: placement_simulation [--images FOLDER] [--seeds N] [theory] [stale] [classroom] "
                   "[campus] [warm] [days] [fleet]\n"
                   "  --seeds N  how many days of campus, warm and days; 20 unless told\n"
                   "  days       the figures of each day where heavy worlds wait\n"
                   "Without names: theory, stale, classroom, campus and warm.\n";
            return 2;
        }
    }
    if (chosen.empty())
        chosen = {"theory", "stale", "classroom", "campus", "warm"};
    for (std::string const& name : chosen)
        experiments.at(name)(output);
}
