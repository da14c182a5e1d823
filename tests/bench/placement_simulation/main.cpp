// placement_simulation [--images FOLDER] [theory] [stale] [classroom] [campus] [warm] [fleet]: without
// names, all but the last, which takes half an hour.
#include "experiments.hpp"

#include <iostream>
#include <map>
#include <string>
#include <vector>

int main(int argc, char** argv)
{
    using namespace simulation;
    std::map<std::string, void (*)(Output&)> const experiments = {
        {"theory", theory}, {"stale", stale_reports}, {"classroom", classroom},
        {"campus", campus}, {"warm", warm_starts},    {"fleet", fleet}};
    Output output{std::cout, {}};
    std::vector<std::string> chosen;
    for (int argument = 1; argument < argc; ++argument) {
        std::string const word = argv[argument];
        if (word == "--images" && argument + 1 < argc) {
            output.images = argv[++argument];
        } else if (experiments.contains(word)) {
            chosen.push_back(word);
        } else {
            std::cerr << "usage: placement_simulation [--images FOLDER] [theory] [stale] [classroom] "
                         "[campus] [warm] [fleet]\n";
            return 2;
        }
    }
    if (chosen.empty())
        chosen = {"theory", "stale", "classroom", "campus", "warm"};
    for (std::string const& name : chosen)
        experiments.at(name)(output);
}
